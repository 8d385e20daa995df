#include <deque>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/report_files.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {
namespace {

constexpr double kAbsoluteFrom_s = 1e6;  // larger times are stamps, not seconds since the start

Stamp absolute(double t_s, Stamp start) {
  return nanoseconds(t_s) + (t_s < kAbsoluteFrom_s ? start : 0);
}

struct TrajectoryCommand {
  std::vector<std::filesystem::path> truths, estimates;
  std::optional<double> from_s, to_s;
  TrajectoryErrorOptions options;
  ReportFiles files;

  void define(CLI::App& app) {
    app.add_option("--truth", truths, "True poses: one file for all estimates or one for each")
        ->required();
    app.add_option("--estimate", estimates, "Estimated poses, one file per robot, or a record")
        ->required();
    app.add_flag("--sim3", options.with_scale, "Align by a similarity: the scale is free");
    app.add_option("--from", from_s,
                   "Judge from here on [s since the truth's first pose; above 1e6: a stamp]");
    app.add_option("--to", to_s, "Judge up to here, as --from");
    app.add_option("--delta", options.rpe_delta_s, "Time of the relative error [s]")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    files.define(app, "the numbers", "truth and estimates from above");
  }

  [[nodiscard]] TimeWindow window_in(const std::vector<StampedPose>& truth) const {
    TimeWindow window = {truth.front().stamp, truth.back().stamp};
    const Stamp start = window.from;
    if (from_s) window.from = absolute(*from_s, start);
    if (to_s) window.to = absolute(*to_s, start);
    if (window.from >= window.to) throw std::invalid_argument("--from is not before --to");
    return window;
  }

  void run() const {
    files.check();
    const auto all = expand_records(estimates);
    const auto true_poses = read_truths(truths, all.size(), "--estimate");
    std::deque<std::vector<StampedPose>> poses;  // inputs refer to them
    std::vector<TrajectoryInput> inputs;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto& truth = of_each(true_poses, i);
      inputs.push_back(
          {short_name(all[i]), truth, poses.emplace_back(read_estimate(all[i])), window_in(truth)});
    }
    const TeamError team = trajectory_error(inputs, options);
    std::cout << to_table(team);
    if (options.with_scale) std::cout << "scale " << team.alignment.scale << '\n';
    files.write([&](std::ostream& out) { out << json_text(team); }, "Truth and estimates",
                [&] { return std::vector{plot_from_above(inputs, team)}; });
  }
};

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

}  // namespace

void add_trajectory(CLI::App& app) {
  add_command<TrajectoryCommand>(app, "trajectory", kTrajectoryDetails);
}

}  // namespace km
