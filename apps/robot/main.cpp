#include <cstdlib>
#include <exception>
#include <iostream>
#include <opencv2/core.hpp>
#include <sstream>

#include "apps/command_line.hpp"
#include "apps/robot/inspect.hpp"
#include "apps/robot/robot_config.hpp"
#include "apps/robot/run.hpp"
#include "runtime/log.hpp"
#include "runtime/unblocked_output.hpp"

namespace km {
namespace {

constexpr int kBadInput = 1, kBadCommandLine = 2;

constexpr const char* kFooter = R"(
Examples
  One robot on a whole recording, in real time:
    kimera_multi_robot --config config/datasets/euroc.yaml --robot 0 --dataset MH_01_easy --output results/a
  Cameras without an inertial sensor: a sequence of KITTI odometry, and one of TUM RGB-D:
    kimera_multi_robot --robot 0 --dataset dataset/sequences/07 --rate max --output results/a
    kimera_multi_robot --robot 0 --dataset rgbd_dataset_freiburg1_desk --rate max --output results/b
  Two robots on two hosts of one network (any ids, they find each other):
    hostA$ kimera_multi_robot --config config/datasets/euroc.yaml --robot 7  --name alice --dataset A --output results/a
    hostB$ kimera_multi_robot --config config/datasets/euroc.yaml --robot 12 --name bob   --dataset B --output results/b
  Without multicast:   --peers 10.0.0.2,10.0.0.3 --interface wlan0 --link wifi
  After a crash or an empty battery, continue the same run (same command, --resume in place of --output):
    kimera_multi_robot --config config/datasets/euroc.yaml --robot 0 --dataset MH_01_easy --resume results/a
  A robot that localises itself in the map of an earlier run, which stays as it is:
    kimera_multi_robot --config config/datasets/euroc.yaml --robot 0 --dataset MH_02_easy --localize results/a --output results/b
  The robot of an earlier run, as a member of the team:
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
    kimera_multi_robot --config config/datasets/tunnels.yaml --robot 3 --graph robot3.csv --rate max --output results/3

Files written to --output: odometry.tum, live.tum, optimized.tum, optimized_keyframes.tum, pose_graph.g2o,
keyframes.csv, loop_closures.csv, optimizer.csv, traffic.csv, process.csv, timing.csv, config.yaml, summary.json,
rig_estimated.yaml (for --rig of the next run), run.journal (for --resume and --session); with mapping.mode on also
mesh.ply, mesh_optimized.ply, label_palette.csv, objects.json, map.yaml and map.pgm; with map.team also team_mesh.ply and
team_map.*; with --record record.mcap. apps/robot/README.md describes all of them.
Ctrl-C, SIGTERM and SIGHUP end the run in order with everything written; a second Ctrl-C or SIGTERM ends it at once.
Exit codes: 0 done; 1 bad input or configuration, a recording that gave no pose, or live sensors that gave no image;
2 bad command line; 3 a module failed while running, or another robot claimed this robot's id; 4 results could not
be written: the log names each and why; 5 a module did not get on (see run.patience): what the others recorded is
written.)";

PlaybackPace parse_pace(const std::string& text) {
  if (text == "max") return PlaybackPace::fastest();
  if (text == "auto") return {};
  char* end = nullptr;
  const double rate = std::strtod(text.c_str(), &end);
  constexpr Bounds<double> kRate{1e-3,
                                 1e6};  // beyond these bounds waiting times overflow the clock
  if (end == text.c_str() || *end != '\0' || !kRate.contains(rate))
    throw CommandLineError(
        "--rate", text + " is neither a positive number nor max nor auto (" + kRate.text() + ")");
  return {.rate = rate, .waits = false};
}

void print_config(const RobotOptions& options) {
  try {
    std::cout << load_robot_config(options).effective;
  } catch (const ConfigError& error) {
    throw CommandLineError("--print-config", error.what());
  }
  throw CommandLineDone();
}

// Prints the topics of --inspect RECORDING [RIG], or of --inspect --live [RIG], and writes the rig
// file.
void print_topics(const RobotOptions& options, Command app, const std::vector<std::string>& paths) {
  const std::vector<std::string> live = app.values("--live");
  if (!live.empty()) {
    if (!paths[0].empty()) throw CommandLineError("--inspect", "name a recording or --live");
    std::cout << inspect_live(load_robot_config(options).ros, live[0]);
  } else if (paths[0].empty()) {
    throw CommandLineError("--inspect", "a recording or --live is needed");
  } else {
    std::cout << (paths.size() == 1 ? inspect_recording(paths[0])
                                    : inspect_recording(paths[0], paths[1]));
  }
  throw CommandLineDone();
}

void add_input(Command app, RobotOptions& options) {
  const Command group = app.add_choice_group("Input", "What the robot perceives");
  group
      .add_option("--dataset", options.dataset,
                  "EuRoC/ASL folder: cam0, cam1 (or depth0), imu0, or mav0/; a folder of KITTI "
                  "odometry, TUM RGB-D or 7-Scenes; or with --rig a bag of ROS 1 (.bag) or ROS 2 "
                  "(folder, .db3, .mcap)")
      .existing_path();
  group
      .add_option_function<std::vector<std::string>>(
          "--live",
          [&options](const std::vector<std::string>& rig) {
            if (rig[0].empty())
              throw CommandLineError("--live",
                                     "a rig file is needed; --inspect --live rig.yaml writes one");
            options.rig = rig[0];
            options.is_live = true;
          },
          "Rig file: its topics are those of drivers that run now, on ROS 2 (see ros: in "
          "config/robot.yaml); until Ctrl-C")
      .expected(0, 1)  // --inspect --live needs none
      .type_name("RIG")
      .existing_file();
  group
      .add_option("--graph", options.graph,
                  "Recorded pose graph of one robot (.g2o or .csv), or of a team (.jrl)")
      .existing_file();
  group
      .add_option("--session", options.session,
                  "Results of a finished run: its robot stands still, and the others localise "
                  "themselves in its map")
      .existing_folder();
  app.add_option("--localize", options.localize,
                 "Results of a finished run: this run localises itself in its map, which stays as "
                 "it is, and all poses are in its frame")
      .existing_folder();
  app.add_option("--extend", options.extend,
                 "Results of a finished run of this robot: the results of this run hold both, and "
                 "all poses are optimised together")
      .existing_folder();
  app.add_option(
         "--rig", options.rig,
         "For a bag: file that states which topics are the sensors, and their calibration; for a "
         "EuRoC folder, what its calibration is off by (rig_estimated.yaml of a run); for a TUM "
         "RGB-D folder, its camera")
      .existing_file();
  app.add_option("--odometry", options.odometry,
                 "Poses of the body by another odometry (TUM: t[s] x y z qx qy qz qw), in place of "
                 "the own one; images still give features and depth")
      .existing_file();
  app.add_option("--from", options.from_s, "Start of the part to play [s since the first image]");
  app.add_option("--to", options.to_s, "End of the part to play [s since the first image]");
  app.add_option_function<std::string>(
         "--rate", [&options](const std::string& text) { options.pace = parse_pace(text); },
         "Speed of playing: auto in real time, and slower if processors are short; max as fast as "
         "they can. Both use every image. A number of times real time, such as 1.0, leaves images "
         "out if processors are short, like a robot with live cameras")
      .default_text("auto");
}

// Runs before the dataset is opened, so that the error names the options.
void check_window(const RobotOptions& options) {
  if (!options.from_s || !options.to_s || *options.from_s < *options.to_s) return;
  std::ostringstream message;
  message << "--from " << *options.from_s << " s is not before --to " << *options.to_s << " s";
  throw CommandLineError(message.str());
}

void check_localize(const RobotOptions& options) {
  if (options.localize.empty() && options.extend.empty()) return;
  if (!options.localize.empty() && !options.extend.empty())
    throw CommandLineError(
        "--localize leaves the map as it is, and --extend does not: give one of them");
  if (!options.graph.empty() || !options.session.empty())
    throw CommandLineError(
        "--localize and --extend compare images: give --dataset or --live, not --graph or "
        "--session");
}

void add_network(Command app, RobotOptions& options) {
  app.add_option(
         "--domain", options.domain,
         "DDS domain of the team: its robots use the same; drivers of ROS are on ros.domain")
      .within(0, 230);
  app.add_option("--link", options.link, "Link profile: wired, wifi, intermittent, or a file");
  app.add_option("--peers", options.peers, "Addresses of the other hosts, where multicast is off")
      .delimiter(',');
  app.add_option("--interface", options.interface_name, "Network interface, e.g. wlan0");
  app.add_flag(
      "--view", options.view,
      "Allow every program in the domain to watch (kimera_multi_viewer): trajectory, mesh, images");
  app.add_option("--security", options.security,
                 "Folder of this robot's keys (kimera_multi_keys): only robots of the team can "
                 "read and send messages")
      .existing_folder();
}

void add_output(Command app, RobotOptions& options) {
  const Command group = app.add_choice_group("Output", "Where the results go");
  group.add_option("--output", options.output, "Folder of the results, made if absent");
  group
      .add_option_function<std::string>(
          "--resume",
          [&options](const std::string& folder) {
            options.output = folder;
            options.resume = true;
          },
          "In place of --output: the folder of a run that was killed; continues where it ended "
          "(all "
          "other options as before)")
      .check([](const std::string& folder) {
        return std::filesystem::is_directory(folder)
                   ? ""
                   : folder + ": there is no such folder, so no run to continue; --output " +
                         folder + " begins one there";
      });
  app.add_option("--fallback", options.fallback,
                 "Folder, on another disk, for results that cannot be written to --output");
  app.add_option_function<std::vector<std::string>>(
         "--record", [&options](const std::vector<std::string>& file) { options.record = file[0]; },
         "Also write what happens to an MCAP file, for Foxglove, Lichtblick, Rerun, PlotJuggler "
         "(default: record.mcap in the folder of the results)")
      .expected(0, 1)
      .type_name("[FILE.mcap]");
  app.add_flag("--record-images", options.record_images, "With --record: the left images, too");
}

// Prints --help or the error of a wrong command line, and exits the process in both cases.
RobotOptions parse_options(int argc, char** argv) {
  RobotOptions options;
  CommandLine line(
      "kimera_multi_robot",
      "One robot of the team: odometry, place recognition, and the team's pose graph.");
  const Command app = line.command();
  app.footer(kFooter);
  app.add_option("--config", options.configs,
                 "Configuration files; a later file overrides earlier ones")
      .existing_file();
  app.add_option("--set", options.settings, "One setting over all files: section.key=value");
  app.add_option("--robot", options.robot, "Id of this robot, any number, unique in the team")
      .within(0, 65535)
      .required();
  app.add_option("--name", options.name, "Name shown to people (default robot<id>)");
  add_input(app, options);
  add_network(app, options);
  add_output(app, options);
  app.add_option("--serve-limit", options.serve_limit_s,
                 "Longest time [s] to serve peers after the own input has ended")
      .within(0.0, 1e6)
      .show_default();
  app.add_flag_callback(
      "--print-config", [&options] { print_config(options); },
      "Print the configuration that the options before this one make, with bounds, and exit");
  app.add_option_function<std::vector<std::string>>(
         "--inspect",
         [&](const std::vector<std::string>& paths) { print_topics(options, app, paths); },
         "Print what is in a recording and exit: a bag of ROS 1 (.bag), one of ROS 2 (folder or "
         ".db3), an MCAP file (.mcap), or a folder of images; with a second file, write a rig file "
         "to it. --inspect --live [RIG]: the same for the topics that drivers publish now")
      .expected(0, 2)
      .type_name("[RECORDING] [RIG]");
  app.add_option("--log", options.log_level, "error, warn, info or debug")
      .one_of({"error", "warn", "info", "debug"})
      .show_default();
  app.callback([&options] {
    check_window(options);
    check_localize(options);
  });
  if (const auto exit_code = line.parse(argc, argv, kBadCommandLine)) std::exit(*exit_code);
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
  const km::RobotOptions options = km::parse_options(argc, argv);
  km::SignalWatch signals;  // before any thread: threads inherit the blocked signals
  km::log::set_level(km::level_of(options.log_level));
  cv::setNumThreads(1);  // every module has its own thread; OpenCV's pool would compete with them
  return km::run_robot(options, signals);
} catch (const std::exception& error) {
  km::unblocked_stderr() << "kimera_multi_robot: " << error.what() << std::endl;
  return km::kBadInput;
}
