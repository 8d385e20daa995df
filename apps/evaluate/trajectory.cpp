#include <cmath>
#include <deque>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/evaluate/recorded_poses.hpp"
#include "apps/report_files.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/evaluation/trajectory_report.hpp"

namespace km {
namespace {

struct TrajectoryCommand {
  std::vector<std::filesystem::path> truths;     // One for all estimates, or one for each.
  std::vector<std::filesystem::path> estimates;  // TUM, EuRoC CSV, or records.
  double from_s = -std::numeric_limits<double>::infinity();
  double to_s = std::numeric_limits<double>::infinity();
  TrajectoryErrorOptions options;
  ReportFiles files;
};

constexpr double kAbsoluteFrom_s = 1e6;  // larger times are stamps, not seconds since the start

Stamp absolute(double t_s, Stamp start) {
  return nanoseconds(t_s) + (t_s < kAbsoluteFrom_s ? start : 0);
}

TimeWindow window_of(const TrajectoryCommand& command, const std::vector<StampedPose>& truth) {
  TimeWindow window = {truth.front().stamp, truth.back().stamp};
  const Stamp start = window.from;
  if (std::isfinite(command.from_s)) window.from = absolute(command.from_s, start);
  if (std::isfinite(command.to_s)) window.to = absolute(command.to_s, start);
  if (window.from >= window.to) throw std::invalid_argument("--from is not before --to");
  return window;
}

void run(TrajectoryCommand command) {
  command.files.check();
  command.estimates = expand_records(command.estimates);
  if (command.truths.size() != 1 && command.truths.size() != command.estimates.size())
    throw std::invalid_argument("give one --truth, or as many as there are --estimate");
  std::vector<std::vector<StampedPose>> truths;
  for (const auto& file : command.truths) truths.push_back(read_trajectory(file));
  std::deque<std::vector<StampedPose>> estimates;  // inputs refer to them
  std::vector<TrajectoryInput> inputs;
  for (std::size_t i = 0; i < command.estimates.size(); ++i) {
    const auto& truth = truths[truths.size() == 1 ? 0 : i];
    estimates.push_back(read_estimate(command.estimates[i]));
    inputs.push_back(
        {short_name(command.estimates[i]), truth, estimates.back(), window_of(command, truth)});
  }

  const TeamError team = trajectory_error(inputs, command.options);
  std::cout << to_table(team);
  if (command.options.with_scale) std::cout << "scale " << team.alignment.scale << '\n';
  command.files.write([&](std::ostream& out) { out << json_text(team); }, "Truth and estimates",
                      [&] { return std::vector{plot_from_above(inputs, team)}; });
}

constexpr const char* kTrajectoryDetails =
    R"(Errors of estimated trajectories against the truth

All estimates are moved by ONE rigid transform (Umeyama) to fit the truth, so several robots
are judged in their common frame. Files are TUM text (t[s] p q x y z w) or EuRoC CSV
(t[ns], p, q w x y z); or MCAP records of robots and teams: FILE.mcap stands for the last
/NAME/path of every robot in it, the optimised poses, and FILE.mcap:/NAME/odometry for one topic
(nav_msgs/Path, nav_msgs/Odometry, geometry_msgs/PoseStamped or PoseWithCovarianceStamped).
The denser of truth and estimate is interpolated at the stamps of the other. Printed per estimate and for the team:
  position error  distance to the truth at each pair [m]: the absolute trajectory error
  rotation        angle to the truth after the same alignment [deg]
  relative        error of the motion over --delta seconds [m, deg]
  covered         share of the truth's time (or of --from to --to) that has poses

Examples:
  kimera_multi_evaluate trajectory --truth groundtruth_tum.txt --estimate odometry.tum
  kimera_multi_evaluate trajectory --truth data.csv \
      --estimate robot0/optimized.tum robot1/optimized.tum --json team.json --plot team.html
  kimera_multi_evaluate trajectory --truth a.csv --truth b.csv --estimate a.tum b.tum
  kimera_multi_evaluate trajectory --truth data.csv --estimate team.mcap)";

void define(CLI::App& app, TrajectoryCommand& command) {
  app.add_option("--truth", command.truths,
                 "True poses: one file for all estimates or one for each")
      ->required();
  app.add_option("--estimate", command.estimates,
                 "Estimated poses, one file per robot, or a record")
      ->required();
  app.add_flag("--sim3", command.options.with_scale, "Align by a similarity: the scale is free");
  app.add_option("--from", command.from_s,
                 "Judge from here on [s since the truth's first pose; above 1e6: a stamp]");
  app.add_option("--to", command.to_s, "Judge up to here, as --from");
  app.add_option("--delta", command.options.rpe_delta_s, "Time of the relative error [s]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--coverage-gap", command.options.max_coverage_gap_s,
                 "Poses further apart leave the time between uncovered [s]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.files.define(app, "the numbers", "truth and estimates from above");
}

}  // namespace

void add_trajectory(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("trajectory", kTrajectoryDetails);
  const auto command = std::make_shared<TrajectoryCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
