#include <deque>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/report_files.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {
namespace {

struct TrajectoryCommand {
  std::vector<std::filesystem::path> truths, estimates;
  ReportFiles files;

  void define(CLI::App& app) {
    app.add_option("--truth", truths, "True poses: one file for all estimates or one for each")
        ->required();
    app.add_option("--estimate", estimates, "Estimated poses, one file per robot, or a record")
        ->required();
    files.define(app, "the numbers", "truth and estimates from above");
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
          {short_name(all[i]), truth, poses.emplace_back(read_estimate(all[i])), std::nullopt});
    }
    const TeamError team = trajectory_error(inputs);
    std::cout << to_table(team);
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
  relative        error of the motion over a second [m, deg]
  covered         share of the truth's time that has poses

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
