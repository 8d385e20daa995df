#include <algorithm>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "apps/output_file.hpp"
#include "apps/program_options.hpp"
#include "apps/result_files.hpp"
#include "apps/result_writer.hpp"
#include "apps/shipped_file.hpp"
#include "apps/team/links_file.hpp"
#include "apps/team/report_page.hpp"
#include "apps/team/run_team.hpp"
#include "apps/team/team_report.hpp"
#include "apps/team/team_results.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/write_file.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/ros_sink.hpp"
#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/domain_draw.hpp"
#include "runtime/unblocked_output.hpp"

namespace {

namespace fs = std::filesystem;

constexpr const char* kAbout =
    R"(Runs a team of robots on this host, one process each, and compares their estimates with the truth.

A team file lists the robots and their inputs: see below, and config/teams/. If it names true poses,
which are in one world for all robots, the tables show the errors of the trajectories and the number
of true closures, per stage: their share (precision), and the share of the possible ones that was found
(recall). A candidate is true if both keyframes see the same place, see closure_truth below. A verified
closure and an inlier are false if the measured pose errs by more than these limits and by more than its
covariance explains (99.9 %). Recall counts pairs of keyframes of two robots that see the same place, and
keyframes that are part of such a pair. With truth_mesh the tables also show the errors of the meshes.

The folder of the results receives report.html, a page for any browser, without a network: the tables
with charts over time, every closure, and the findings.

Ctrl-C asks the robots to end in order and prints the results; a second one ends them at once. If this
program is killed, the robots end in order and write their results.
Exit codes: 0 if every robot ended without a failure; 1 for unusable input and results that cannot be
written; 2 for a bad command line; 3 if a robot failed.

Examples:
  kimera_multi_team --config config/teams/euroc_two_robots.yaml --dataset MH_01_easy
  kimera_multi_team --config config/teams/tunnels.yaml --dataset tunnels_8robots --rate max
  kimera_multi_team --config team.yaml -- --set mapping.mode=off   # after --: for every robot
  kimera_multi_team --config team.yaml --links config/links/lossy.yaml
  kimera_multi_team --config team.yaml --record   # for Foxglove, Rerun, ...: team.mcap
  kimera_multi_team --config team.yaml --output results --report   # of robots that ran elsewhere)";

constexpr const char* kHintForUnknown = R"(Options of the robots come after --:
  kimera_multi_team --config team.yaml -- --set mapping.mode=off
)";

struct TeamOptions {
  fs::path config, dataset, output, security, links, json, robot_binary;
  std::string rate;
  std::optional<std::uint32_t> domain;
  std::vector<std::string> arguments;
  std::optional<fs::path> record;  // empty: in the folder of the results
  bool view = false;
  bool report = false;
};

void define(CLI::App& app, TeamOptions& options) {
  app.footer(
      "Keys of a team file, paths relative to it:\n" + km::team_file_keys() +
      "\nKeys of a file of links, paths relative to it. seed, pairs and partitions are of the "
      "file;\nthe others are of every link, and in pairs of the links named there:\n" +
      km::links_file_keys());
  options.robot_binary = km::program_folder() / "kimera_multi_robot";
  app.add_option("--config", options.config,
                 "Team file, or the name of a shipped one, such as euroc_two_robots")
      ->required()
      ->transform(km::named_file("teams"));
  app.add_option("--dataset", options.dataset, "Value of ${DATASET} in the team file");
  app.add_option(
         "--rate", options.rate,
         "Times real time, max, or auto, see kimera_multi_robot --help (default: the file's, auto)")
      ->check([](const std::string& text) {
        return km::is_rate(text) ? "" : text + " is neither a positive number nor max nor auto";
      });
  app.add_option("--domain", options.domain,
                 "DDS domain (default: the file's, or one that no other team here has)")
      ->check(CLI::Range(0, 230));
  app.add_option("--output", options.output, "Results, one folder per robot (default: the file's)");
  app.add_option("--security", options.security,
                 "Team folder of kimera_multi_keys: each robot uses the keys in its folder there");
  CLI::Option* const links = app.add_option(
      "--links", options.links,
      "File of bad links, see below and config/links, or a link recorded by Mahimahi "
      "(.up, .down): "
      "each robot gets a network of its own");
  app.add_option("--json", options.json, "Also write the results to this file, as JSON");
  app.add_option("--robot-binary", options.robot_binary,
                 "Program of a robot (default: the one beside this)");
  app.add_option_function<std::vector<std::string>>(
         "--record", [&options](const std::vector<std::string>& file) { options.record = file[0]; },
         "Each robot writes record.mcap, for Foxglove, Lichtblick, Rerun, PlotJuggler, and at the "
         "end they become one file (default: team.mcap in the folder of the results)")
      ->expected(0, 1)
      ->type_name("[FILE.mcap]");
  app.add_flag(
      "--view", options.view,
      "Robots allow every program in the domain to watch them: kimera_multi_viewer --domain N");
  app.add_flag("--report", options.report,
               "Start nothing: the tables of a run that has ended, from its folders in --output")
      ->excludes(links);
  app.add_option("arguments", options.arguments, "After --: more arguments of every robot");
}

// Options of the command line override the team file.
km::TeamPlan make_plan(const TeamOptions& options) {
  km::TeamPlan plan = km::read_team_file(options.config, options.dataset);
  if (!options.rate.empty()) plan.rate = options.rate;
  if (!options.output.empty()) plan.output = options.output;
  if (options.domain) plan.domain = options.domain;
  // Teams on one host must not meet. The lower half remains for domains chosen by people.
  if (!plan.domain && !options.report)
    plan.domain = km::draw_domain(km::kLastQuietDomain / 2 + 1, km::kLastQuietDomain);
  plan.record = options.record.has_value();
  plan.view = options.view;
  if (!options.security.empty()) plan.security = options.security;
  if (!plan.security.empty() && !km::is_folder(plan.security))
    throw std::runtime_error(plan.security.string() + ": no such folder of keys");
  for (km::RobotPlan& robot : plan.robots)
    robot.arguments.insert(robot.arguments.end(), options.arguments.begin(),
                           options.arguments.end());
  return plan;
}

// Writes the counts of the frames to links.csv. A failure is logged and does not end the program,
// because the run has ended.
void write_links(const km::TeamPlan& plan, km::EmulatedLinks& links, km::ResultWriter& results) {
  std::vector<std::string> names;
  for (const km::RobotPlan& robot : plan.robots) names.push_back(robot.name);
  results.write(plan.output / km::kLinksTable, [&](const fs::path& file) {
    km::write_file(file, km::links_csv(links.finish(), names));
  });
}

bool replaces_a_run(const km::TeamPlan& plan) {
  return std::ranges::any_of(plan.robots, [&plan](const km::RobotPlan& robot) {
    return !km::robot_folders(plan.output / robot.name).empty();
  });
}

constexpr int kNoRobot = 126;  // as a shell's for a program that cannot be run

std::vector<km::RobotRun> run_robots(const TeamOptions& options, const km::TeamPlan& plan,
                                     km::ResultWriter& results) {
  if (access(options.robot_binary.c_str(), X_OK) != 0)
    throw std::runtime_error(options.robot_binary.string() + ": no such program; build it, or " +
                             "give --robot-binary");
  km::SignalWatch signals;
  std::optional<km::EmulatedLinks> links;
  if (!options.links.empty()) links.emplace(km::read_links_file(options.links, plan));
  std::vector<std::string> names;
  for (const km::RobotPlan& robot : plan.robots) names.push_back(robot.name);
  std::ostream& out = km::unblocked_stdout();
  out << names.size() << " robots in DDS domain " << *plan.domain << ", results in "
      << plan.output.string() << (replaces_a_run(plan) ? ", in place of an earlier run's" : "")
      << std::endl;
  km::TeamDisplay display(names);
  std::vector<km::RobotRun> runs =
      km::run_team(options.robot_binary, plan, signals, display, links ? &*links : nullptr);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].exit.ok() || !runs[i].last_log_lines.empty()) continue;
    if (km::is_file(plan.output / names[i] / km::kSummary)) continue;
    runs[i].exit.code = kNoRobot;
    runs[i].last_log_lines = {"no output and no " + std::string(km::kSummary) + ": is " +
                              options.robot_binary.string() + " kimera_multi_robot?"};
    display.update(i, "FAILED: " + runs[i].last_log_lines.front());
  }
  out << '\n';
  if (links) write_links(plan, *links, results);
  return runs;
}

// Copies names and colours of the labels beside the team's mesh, from the first robot that has
// them.
void copy_palette(const km::TeamPlan& plan) {
  for (const km::RobotPlan& robot : plan.robots) {
    const fs::path own = plan.output / robot.name / km::kLabelPalette;
    if (!fs::exists(own)) continue;
    fs::copy_file(own, plan.output / km::kLabelPalette, fs::copy_options::overwrite_existing);
    return;
  }
}

km::RosTFMessage root_transform(const std::string& root, km::Stamp stamp) {
  return {{{{stamp, "map"}, km::ros_name(root) + "/map", {}}}};
}

// Records in the folder of a robot, in order.
std::vector<fs::path> robot_records(const fs::path& folder) {
  std::vector<fs::path> records;
  fs::path file = folder / km::kRecord;
  for (int number = 2; fs::exists(file); ++number) {
    records.push_back(file);
    file = km::numbered(folder / km::kRecord, number);
  }
  return records;
}

// Merges records into one file by time. Topics of equal name and type become one. Attached files
// are named after the robots' folders, "alice/keyframes.csv". If `root` names a robot, its map
// frame is that of the team: /tf_static publishes it as `map`.
void merge_records(std::span<const fs::path> records, const std::string& root,
                   const fs::path& file) {
  std::vector<std::unique_ptr<km::BagReader>> readers;
  for (const fs::path& record : records) readers.push_back(km::open_mcap(record));
  const auto merged = km::merge_bags(std::move(readers));
  std::optional<std::string> failure;
  km::McapSink sink(file, [&failure](const std::string& why) { failure = why; });
  const std::size_t statics = sink.open({"/tf_static", km::RosTFMessage::kType, true, 1});
  std::vector<std::size_t> topics;
  bool begun = root.empty();
  while (const auto message = merged->next()) {
    for (std::size_t k = topics.size(); k < merged->channels().size(); ++k)
      topics.push_back(
          sink.open({merged->channels()[k].topic, km::ros1_name(merged->channels()[k].type)}));
    if (!std::exchange(begun, true))
      sink.put(statics, message->log_time, km::encode_ros(root_transform(root, message->log_time)));
    sink.put(topics[message->channel], message->log_time, message->bytes);
    if (failure) break;
  }
  for (const fs::path& record : records)
    for (const auto& [name, text] : km::read_mcap_attachments(record))
      sink.attach(record.parent_path().filename().string() + '/' + name, text);
  sink.finish();
  if (failure) throw std::runtime_error(*failure);
}

// Merges the records of all robots, in the frame of the joined robots if there are some.
void write_record(const km::TeamPlan& plan, const km::TeamResult& team, const fs::path& file) {
  std::vector<fs::path> records;
  std::string root;
  for (const km::RobotResult& robot : team.robots) {
    const auto own = robot_records(plan.output / robot.plan.name);
    records.insert(records.end(), own.begin(), own.end());
    const auto frame = km::frame_of(robot);
    if (!frame || !robot.in_team_frame) continue;
    for (const km::RobotPlan& other : plan.robots)
      if (other.id == *frame) root = other.name;
  }
  if (records.empty()) throw std::runtime_error("no robot has left a record");
  merge_records(records, root, file);
}

// Writes the JSON, the report and the mesh of the whole team. Prints the files to `out`, except
// for the JSON.
void write_results(const TeamOptions& options, const km::TeamPlan& plan, const km::TeamResult& team,
                   km::ResultWriter& results, std::ostream& out) {
  if (!options.json.empty())
    results.write(options.json, [&](const fs::path& file) { km::write_json_output(file, team); });
  if (!std::ranges::all_of(team.robots, &km::RobotResult::left_nothing))
    results.write(plan.output / km::kReportPage, [&](const fs::path& file) {
      km::write_report(file, plan, team);
      out << "\nThe report, for a browser: " << file.string() << '\n';
    });
  if (options.record)
    results.write(options.record->empty() ? plan.output / km::kTeamRecord : *options.record,
                  [&](const fs::path& file) {
                    write_record(plan, team, file);
                    out << "\nThe record of all robots: " << file.string() << '\n';
                  });
  if (!team.meshes.merged.empty())
    results.write(plan.output / km::kTeamMesh, [&](const fs::path& file) {
      km::write_mesh(file, team.meshes.merged);
      copy_palette(plan);
      out << "The mesh of all robots" << (team.optimized ? ", in the frame of the truth: " : ": ")
          << file.string() << '\n';
    });
}

int run(const TeamOptions& options) {
  const km::TeamPlan plan = make_plan(options);
  if (!options.report) km::make_output_folder(plan.output);  // the files below may be in it
  km::check_output_folder(options.json);
  if (options.record) km::check_output_folder(*options.record);
  km::ResultWriter results;
  const km::TeamResult team = km::collect_results(
      plan, options.report ? km::finished_runs(plan) : run_robots(options, plan, results));
  std::ostream& out = km::unblocked_stdout();
  out << to_table(team);
  write_results(options, plan, team, results, out);
  const bool ok = std::all_of(team.robots.begin(), team.robots.end(),
                              [](const km::RobotResult& robot) { return robot.run.exit.ok(); });
  if (!ok) return 3;
  return results.lost().empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout, "kimera_multi_team");
  TeamOptions options;
  define(app, options);
  // The parser takes "--" after --record only as the end of its values.
  char** const robots = std::find(argv, argv + argc, std::string_view("--"));
  if (const auto exit_code =
          km::parse_options(app, static_cast<int>(robots - argv), argv, kHintForUnknown))
    return *exit_code;
  if (robots != argv + argc)
    options.arguments.insert(options.arguments.end(), robots + 1, argv + argc);
  return run(options);
} catch (const std::exception& error) {
  km::unblocked_stderr() << "kimera_multi_team: " << error.what() << std::endl;
  return 1;
}
