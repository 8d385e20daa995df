#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "apps/doctor/examine.hpp"
#include "apps/doctor/network_facts.hpp"
#include "apps/output_file.hpp"
#include "apps/program_options.hpp"
#include "apps/robot/robot_config.hpp"
#include "apps/stage_progress.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kUnusable = 2;

constexpr const char* kAbout =
    "Finds faults of a recording, of live sensors, of the network between robots, or of a run. "
    "Each finding states a number, its consequence and a remedy.";

constexpr const char* kFooter = R"(
PATH is a recording (folder of EuRoC/ASL, KITTI odometry, TUM RGB-D or 7-Scenes; a bag of ROS 1 or 2 or an MCAP file, with --rig), or the results of
a robot or of a team.

Examples
  Are calibration, units and stamps of a recording right? Looks at the images, not only at the numbers:
    kimera_multi_doctor MH_01_easy
    kimera_multi_doctor recording.bag --rig rig.yaml --from 10 --to 40
  Do the drivers of this robot publish what the rig file names, and is it sound? Move the robot meanwhile:
    kimera_multi_doctor --live rig.yaml
  Why did two robots not join?
    kimera_multi_doctor results/team
  Can robots receive each other here? On which domain are the others?
    kimera_multi_doctor --network --domain 42
    kimera_multi_doctor --network --peers 10.0.0.2,10.0.0.3 --interface wlan0 --link wifi
  For programs:
    kimera_multi_doctor MH_01_easy --json doctor.json

A quantity that motion and images do not determine is listed, and is no finding. Turn the camera about two
axes to determine it.
Exit codes: 0 sound; 1 warnings; 2 errors, or an unusable command line or PATH.)";

struct Options {
  RobotOptions robot;
  fs::path path, live, json;
  bool network = false;
  double seconds = 0.0;
};

void add_network(CLI::App& app, Options& options) {
  RobotOptions& robot = options.robot;
  app.add_flag("--network", options.network, "Examine the network and the participants on it");
  app.add_option("--domain", robot.domain, "DDS domain of the team")->check(CLI::Range(0, 230));
  app.add_option("--peers", robot.peers, "Addresses of the other hosts: also asked for echoes")
      ->delimiter(',');
  app.add_option("--interface", robot.interface_name, "Network interface, e.g. wlan0");
  app.add_option("--link", robot.link, "Link profile: wired, wifi, intermittent, or a file");
}

void check(const Options& options, const CLI::App& app) {
  const int asked =
      (options.path.empty() ? 0 : 1) + (options.live.empty() ? 0 : 1) + (options.network ? 1 : 0);
  if (asked != 1) throw CLI::ValidationError("name one of PATH, --live and --network");
  if (!options.network && app.count("--domain") > 0)
    throw CLI::ValidationError(
        "--domain is that of the team: with --network; drivers are on --set ros.domain=N");
  const RobotOptions& robot = options.robot;
  if (robot.from_s && robot.to_s && !(*robot.from_s < *robot.to_s))
    throw CLI::ValidationError("--from is not before --to");
}

Options options_of(int argc, char** argv) {
  Options options;
  RobotOptions& robot = options.robot;
  CLI::App app(kAbout, "kimera_multi_doctor");
  app.footer(kFooter);
  app.add_option("PATH", options.path, "Recording, or results");
  app.add_option("--live", options.live, "Rig file: look at the live topics that it names (ROS 2)")
      ->transform(named_file("rigs"));
  add_network(app, options);
  app.add_option("--rig", robot.rig, "For a bag: which topics are the sensors, and calibration")
      ->transform(named_file("rigs"));
  app.add_option("--from", robot.from_s, "Look from here on [s since the first image]");
  app.add_option("--to", robot.to_s, "Look up to here [s]; by default 120 s are looked at");
  app.add_option("--seconds", options.seconds,
                 "How long to look at sensors once 3 s have shown that all are there, by default "
                 "10; how long to listen to the network, by default 5")
      ->check(CLI::Range(0.5, 3600.0));
  app.add_option("--config", robot.configs, "Configuration files of the robots")
      ->transform(named_file("datasets"));
  app.add_option("--set", robot.settings, "One setting over all files: section.key=value");
  app.add_option("--json", options.json, "Also write figures and findings to this file");
  app.callback([&options, &app] { check(options, app); });
  if (const auto exit_code = parse_options(app, argc, argv)) std::exit(*exit_code);
  return options;
}

Examination examine_dataset(const Options& options, const ReportProgress& report_progress) {
  RobotOptions robot = options.robot;
  robot.dataset = options.path;
  constexpr double kLongest_s = 120.0;
  if (!robot.to_s) robot.to_s = robot.from_s.value_or(0.0) + kLongest_s;
  return examine_recording(robot, load_robot_config(robot), 0.0, report_progress);
}

Examination examine_live(const Options& options, const ReportProgress& report_progress) {
  RobotOptions robot = options.robot;
  robot.rig = options.live;
  robot.is_live = true;
  const RobotConfig config = load_robot_config(robot);
  constexpr double kTopics_s = 3.0, kSensors_s = 10.0;
  Examination result = examine_live_topics(read_rig_file(robot.rig).rig.topics, config.ros,
                                           kTopics_s, report_progress);
  if (exit_code_of(result.findings) < kUnusable)
    result.add(examine_recording(
        robot, config, options.seconds > 0.0 ? options.seconds : kSensors_s, report_progress));
  sort_by_severity(result.findings);
  return result;
}

Examination run(const Options& options, const ReportProgress& report_progress) {
  if (!options.live.empty()) return examine_live(options, report_progress);
  if (!options.network)
    return are_results(options.path) ? examine_results(options.path)
                                     : examine_dataset(options, report_progress);
  constexpr double kNetwork_s = 5.0;
  return examine_network(probe_network(load_robot_config(options.robot).dds,
                                       options.seconds > 0.0 ? options.seconds : kNetwork_s,
                                       report_progress));
}

std::string conclusion(const std::vector<Finding>& findings) {
  const auto count = [&](Severity severity) {
    return std::ranges::count(findings, severity, &Finding::severity);
  };
  const auto errors = count(Severity::kError), warnings = count(Severity::kWarning);
  const auto notes = count(Severity::kNote);
  if (errors + warnings + notes == 0) return "sound\n";
  if (errors + warnings == 0)
    return "sound, with " + std::to_string(notes) + (notes == 1 ? " note\n" : " notes\n");
  return std::to_string(errors) + (errors == 1 ? " error, " : " errors, ") +
         std::to_string(warnings) + (warnings == 1 ? " warning\n" : " warnings\n");
}

void write_json(const fs::path& file, const Examination& result) {
  write_output(file, [&](std::ostream& out) {
    Json figures = Json::array();
    for (const Figure& figure : result.figures)
      figures.push_back({{"name", figure.name}, {"value", figure.value}});
    out << json_text({{"exit_code", exit_code_of(result.findings)},
                      {"findings", result.findings},
                      {"figures", figures}});
  });
}

int diagnose(const Options& options) {
  check_output_folder(options.json);
  Examination result;
  {
    StageProgress progress;
    result =
        run(options, [&progress](std::string_view stage, double share) { progress(stage, share); });
  }
  std::cout << to_text(result.figures) << (result.findings.empty() ? "" : "\n")
            << to_text(result.findings) << '\n'
            << conclusion(result.findings);
  write_json(options.json, result);
  return exit_code_of(result.findings);
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) try {
  const km::Options options = km::options_of(argc, argv);
  km::log::set_level(km::log::Level::kError);  // because findings report faults
  cv::setNumThreads(1);
  return km::diagnose(options);
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_doctor: " << error.what() << '\n';
  return km::kUnusable;
}
