#include <cstdlib>
#include <exception>
#include <iostream>
#include <opencv2/core.hpp>

#include "apps/program_options.hpp"
#include "apps/robot/inspect.hpp"
#include "apps/robot/robot_config.hpp"
#include "apps/robot/run.hpp"
#include "modules/core/io/input_file.hpp"
#include "runtime/log.hpp"
#include "runtime/unblocked_output.hpp"
#include "runtime/yaml_config.hpp"

namespace km {
namespace {

constexpr const char* kFooter = R"(
Examples
  One robot on a whole recording, in real time:
    kimera_multi_robot --config euroc --robot 0 --dataset MH_01_easy --output results/a
  Cameras without an inertial sensor: a sequence of KITTI odometry, and one of TUM RGB-D:
    kimera_multi_robot --robot 0 --dataset dataset/sequences/07 --rate max --output results/a
    kimera_multi_robot --robot 0 --dataset rgbd_dataset_freiburg1_desk --rate max --output results/b
  Two robots on two hosts of one network (any ids, they find each other):
    hostA$ kimera_multi_robot --config euroc --robot 7  --name alice --dataset A --output results/a
    hostB$ kimera_multi_robot --config euroc --robot 12 --name bob   --dataset B --output results/b
  Without multicast:   --peers 10.0.0.2,10.0.0.3 --interface wlan0 --link wifi
  After a crash or an empty battery, continue the same run (same command, --resume in place of --output):
    kimera_multi_robot --config euroc --robot 0 --dataset MH_01_easy --resume results/a
  A robot that localises itself in the map of an earlier run, and does not change it:
    kimera_multi_robot --config euroc --robot 0 --dataset MH_02_easy --localize results/a --output results/b
  The robot of an earlier run as a member of the team:
    kimera_multi_robot --robot 0 --session results/a --output results/yesterday
  Topics of a recording and the regularity of their stamps; then a robot on the topics that rig.yaml names:
    kimera_multi_robot --inspect recording.bag rig.yaml
    kimera_multi_robot --robot 0 --dataset recording.bag --rig rig.yaml --output results/a
  On the sensors of this robot, whose drivers run on ROS 2; --inspect finds their topics:
    kimera_multi_robot --set ros.domain=0 --inspect --live rig.yaml
    kimera_multi_robot --robot 0 --live rig.yaml --output results/a
  With a record that Foxglove, Lichtblick, Rerun and PlotJuggler open:
    kimera_multi_robot --robot 0 --dataset MH_01_easy --output results/a --record
  The back-end alone, on a recorded pose graph:
    kimera_multi_robot --config tunnels --robot 3 --graph robot3.csv --rate max --output results/3

Files written to --output: odometry.tum, live.tum, optimized.tum, optimized_keyframes.tum, pose_graph.g2o,
loop_closures.csv, summary.json, config.yaml, run.journal (for --resume and --session) and others; with a map also
mesh.ply, mesh_optimized.ply, map.yaml and map.pgm. apps/robot/outputs.md describes all of them.
Ctrl-C, SIGTERM and SIGHUP end the run in order with everything written; a second Ctrl-C or SIGTERM ends it at once.
Exit codes: 0 done; 1 missing or bad input, a recording without a pose, or live sensors without an image;
2 bad command line; 3 a module failed, or another robot uses this robot's id; 4 results could not be written (the log
names each file and the reason); 5 a module was stuck (see run.patience): the results of the other modules are
written.)";

PlaybackPace parse_pace(const std::string& text) {
  if (text == "max") return PlaybackPace::fastest();
  if (text == "auto") return {};
  char* end = nullptr;
  const double rate = std::strtod(text.c_str(), &end);
  constexpr Bounds<double> kRate{1e-3,
                                 1e6};  // beyond these bounds waiting times overflow the clock
  if (end == text.c_str() || *end != '\0' || !kRate.contains(rate))
    throw CLI::ValidationError(
        "--rate", text + " is neither a positive number nor max nor auto (" + kRate.text() + ")");
  return {.rate = rate, .waits = false};
}

void print_config(const RobotOptions& options) {
  std::cout << load_robot_config(options).effective;
  throw CLI::Success();
}

// Prints the topics of --inspect RECORDING [RIG], or of --inspect --live [RIG], and writes the rig
// file.
void print_topics(const RobotOptions& options, CLI::App& app,
                  const std::vector<std::string>& paths) {
  const std::vector<std::string> live = app.get_option("--live")->results();
  if (!live.empty()) {
    if (!paths[0].empty()) throw CLI::ValidationError("--inspect", "name a recording or --live");
    std::cout << inspect_live(load_robot_config(options).ros, live[0]);
  } else if (paths[0].empty()) {
    throw CLI::ValidationError("--inspect", "a recording or --live is needed");
  } else {
    std::cout << (paths.size() == 1 ? inspect_recording(paths[0])
                                    : inspect_recording(paths[0], paths[1]));
  }
  throw CLI::Success();
}

void add_input(CLI::App& app, RobotOptions& options) {
  CLI::App& group = *app.add_option_group("Input", "What the robot perceives");
  group.require_option(1);
  group.add_option(
      "--dataset", options.dataset,
      "Recording: a folder of EuRoC/ASL (cam0, cam1 or depth0, imu0), KITTI odometry, "
      "TUM RGB-D or 7-Scenes; with --rig a bag of ROS 1 (.bag) or ROS 2 (folder, .db3, "
      ".mcap)");
  group
      .add_option_function<std::vector<std::string>>(
          "--live",
          [&options](const std::vector<std::string>& rig) {
            if (rig[0].empty())
              throw CLI::ValidationError(
                  "--live", "a rig file is needed; --inspect --live rig.yaml writes one");
            options.rig = rig[0];
            options.is_live = true;
          },
          "Rig file with the topics of drivers that run now, on ROS 2 (see ros: in "
          "config/robot.yaml); runs until Ctrl-C")
      ->expected(0, 1)  // --inspect --live needs none
      ->type_name("RIG")
      ->transform(named_file("rigs"));
  group.add_option("--graph", options.graph,
                   "Recorded pose graph of one robot (.g2o or .csv), or of a team (.jrl)");
  group.add_option("--session", options.session,
                   "Results of a finished run: its robot stands still, and other robots localise "
                   "themselves in its map");
  app.add_option(
      "--localize", options.localize,
      "Results of a finished run: this run localises itself in that map. The map does not "
      "change, and all poses are in its frame");
  app.add_option("--extend", options.extend,
                 "Results of a finished run of this robot: poses of both runs are optimised "
                 "together, and the results of this run contain both")
      ->excludes("--localize");
  app.add_option(
         "--rig", options.rig,
         "For a bag: file with the topics and the calibration of the sensors; for a EuRoC folder: "
         "corrections of its calibration (rig_estimated.yaml of a run); for a TUM RGB-D folder: "
         "calibration of its camera; or the name of a shipped one, such as d455")
      ->transform(named_file("rigs"));
  app.add_option("--odometry", options.odometry,
                 "Poses of the body, in any format of kimera_multi_evaluate trajectory, that "
                 "replace the robot's visual-inertial odometry; images still give features and "
                 "depth");
  app.add_option("--from", options.from_s, "Start of the part to play [s since the first image]");
  app.add_option("--to", options.to_s, "End of the part to play [s since the first image]");
  app.add_option_function<std::string>(
         "--rate", [&options](const std::string& text) { options.pace = parse_pace(text); },
         "Speed of the recording. auto: real time, or slower if the processors need it; max: as "
         "fast as the processors can. Both use every image. A number, such as 1.0: times "
         "real time; images are left out if the processors are too slow, as with live cameras")
      ->default_str("auto");
}

// Refuses options that the input of the run does not use.
void check_use(const CLI::App& app) {
  const std::pair<const char*, std::string_view> uses[] = {
      {"--rate", "--dataset --graph"},    {"--from", "--dataset --live"},
      {"--to", "--dataset --live"},       {"--rig", "--dataset"},
      {"--odometry", "--dataset --live"}, {"--localize", "--dataset --live"},
      {"--extend", "--dataset --live"}};
  for (const auto& [option, inputs] : uses)
    for (const char* input : {"--dataset", "--live", "--graph", "--session"})
      if (app.count(option) > 0 && app.count(input) > 0 && inputs.find(input) == inputs.npos)
        throw CLI::ValidationError(std::string(option) + " has no effect with " + input);
}

void add_network(CLI::App& app, RobotOptions& options) {
  app.add_option(
         "--domain", options.domain,
         "DDS domain of the team, the same for all its robots; drivers of ROS use ros.domain")
      ->check(CLI::Range(0, 230));
  app.add_option("--link", options.link, "Link profile: wired, wifi, intermittent, or a file");
  app.add_option("--peers", options.peers, "Addresses of the other hosts, where multicast is off")
      ->delimiter(',');
  app.add_option("--interface", options.interface_name, "Network interface, e.g. wlan0");
  app.add_flag(
      "--view", options.view,
      "Allow every program in the domain to watch (kimera_multi_viewer): trajectory, mesh, images");
  app.add_option("--security", options.security,
                 "Folder of this robot's keys (kimera_multi_keys): only robots of the team can "
                 "read and send messages");
}

void add_output(CLI::App& app, RobotOptions& options) {
  CLI::App& group = *app.add_option_group("Output", "Where the results go");
  group.require_option(1);
  group.add_option(
      "--output", options.output,
      "Folder of the results, made if absent; those of an earlier run in it are replaced");
  group.add_option_function<std::string>(
      "--resume",
      [&options](const std::string& folder) {
        if (!is_folder(folder))
          throw InputFileError(folder + ": no such folder; --output " + folder +
                               " starts a run there");
        options.output = folder;
        options.resume = true;
      },
      "In place of --output: the folder of a run that was killed, which continues where it "
      "ended; all other options as before");
  app.add_option_function<std::vector<std::string>>(
         "--record", [&options](const std::vector<std::string>& file) { options.record = file[0]; },
         "Also write an MCAP file, for Foxglove, Lichtblick, Rerun, PlotJuggler (default: "
         "record.mcap in the folder of the results)")
      ->expected(0, 1)
      ->type_name("[FILE.mcap]");
  app.add_flag("--record-images", options.record_images,
               "With --record: also record the left images")
      ->needs("--record");
}

// Prints --help or the error of a wrong command line, and exits the process in both cases.
RobotOptions options_of(int argc, char** argv) {
  RobotOptions options;
  CLI::App app("One robot of the team: odometry, place recognition, and the team's pose graph.",
               "kimera_multi_robot");
  app.footer(kFooter);
  app.add_option("--config", options.configs,
                 "Configuration files, or names of shipped ones, such as euroc; a later file "
                 "overrides earlier ones")
      ->transform(named_file("datasets"));
  app.add_option("--set", options.settings, "One setting over all files: section.key=value");
  app.add_option("--robot", options.robot, "Id of this robot, any number, unique in the team")
      ->check(CLI::Range(0, 65535))
      ->required();
  app.add_option("--name", options.name, "Name shown to people (default robot<id>)");
  add_input(app, options);
  add_network(app, options);
  add_output(app, options);
  app.add_option("--serve-limit", options.serve_limit_s,
                 "Longest time [s] to serve peers after the own input has ended")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_flag_callback(
      "--print-config", [&options] { print_config(options); },
      "Print the configuration with the options before this one, its units and bounds, and exit");
  app.add_option_function<std::vector<std::string>>(
         "--inspect",
         [&](const std::vector<std::string>& paths) { print_topics(options, app, paths); },
         "Print the content of a recording (bag, MCAP file or folder of images) and exit; with a "
         "second file, write a rig file to it. --inspect --live [RIG]: the same for the topics "
         "that drivers publish now")
      ->expected(0, 2)
      ->type_name("[RECORDING] [RIG]");
  app.add_option("--log", options.log_level, "error, warn, info or debug")
      ->check(CLI::IsMember({"error", "warn", "info", "debug"}))
      ->capture_default_str();
  app.callback([&] {
    check_use(app);
    if (options.from_s && options.to_s && !(*options.from_s < *options.to_s))
      throw CLI::ValidationError("--from " + app["--from"]->as<std::string>() +
                                 " s is not before --to " + app["--to"]->as<std::string>() + " s");
  });
  if (const auto exit_code = parse_options(app, argc, argv)) std::exit(*exit_code);
  if (options.name.empty()) options.name = "robot" + std::to_string(options.robot);
  return options;
}

log::Level level_of(const std::string& name) {
  if (name == "error") return log::Level::kError;
  if (name == "warn") return log::Level::kWarn;
  return name == "debug" ? log::Level::kDebug : log::Level::kInfo;
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  const km::RobotOptions options = km::options_of(argc, argv);
  km::SignalWatch signals;  // before any thread: threads inherit the blocked signals
  km::log::set_level(km::level_of(options.log_level));
  cv::setNumThreads(1);  // every module has its own thread; OpenCV's pool would compete with them
  return km::run_robot(options, signals);
} catch (const std::exception& error) {
  km::unblocked_stderr() << "kimera_multi_robot: " << error.what() << std::endl;
  if (dynamic_cast<const km::CommandLineError*>(&error) == nullptr) return km::kBadInput;
  km::unblocked_stderr() << "Run with --help for more information." << std::endl;
  return km::kBadCommandLine;
}
