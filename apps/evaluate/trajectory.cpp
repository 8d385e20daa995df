#include <algorithm>
#include <deque>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "apps/evaluate/commands.hpp"
#include "apps/evaluate/inputs.hpp"
#include "apps/output_file.hpp"
#include "modules/charts/chart_page.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/evaluation/trajectory_error.hpp"

namespace km {
namespace {

PlotPoint from_above(const SE3& T) {
  return {T.translation().x(), T.translation().y()};
}

// Series of each distinct truth, cropped to the time that its estimates cover. The rest of a long
// recording would make the compared part small in the plot.
std::vector<PlotSeries> truth_series(std::span<const TrajectoryInput> inputs) {
  struct Drawn {
    std::span<const StampedPose> truth;
    Stamp first, last;
  };
  std::map<const StampedPose*, Drawn> drawn;
  for (const TrajectoryInput& input : inputs) {
    if (input.truth.empty() || input.estimate.empty()) continue;
    const Stamp first = input.estimate.front().stamp;
    const Stamp last = input.estimate.back().stamp;
    Drawn& entry =
        drawn.try_emplace(input.truth.data(), Drawn{input.truth, first, last}).first->second;
    entry.first = std::min(entry.first, first);
    entry.last = std::max(entry.last, last);
  }
  std::vector<PlotSeries> all;
  for (const auto& [key, entry] : drawn) {
    PlotSeries& series = all.emplace_back();
    series.name = "truth";
    series.colour = PlotSeries::kGrey;
    series.width_px = 3.0;
    for (const StampedPose& pose : entry.truth)
      if (pose.stamp >= entry.first && pose.stamp <= entry.last)
        series.points.push_back(from_above(pose.T));
  }
  return all;
}

// A map of truth (grey) and aligned estimates (one colour each). The name of each estimate includes
// its position rmse. Identical truths are drawn once, over the time of their estimates.
Plot plot_from_above(std::span<const TrajectoryInput> inputs, const TeamError& team) {
  Plot plot{.title = "From above", .series = truth_series(inputs)};
  for (std::size_t r = 0; r < inputs.size(); ++r) {
    PlotSeries& series = plot.series.emplace_back();
    series.name = team.robots[r].name + ", position rmse " +
                  rounded(team.robots[r].position_m.rmse, 3) + " m";
    series.colour = r;
    series.width_px = 1.2;
    for (const StampedPose& pose : inputs[r].estimate)
      series.points.push_back(from_above(team.T_truth_estimate * pose.T));
  }
  return plot;
}

struct TrajectoryCommand {
  std::vector<std::filesystem::path> truths, estimates;
  std::filesystem::path json, plot;

  void define(CLI::App& app) {
    app.add_option("--truth", truths, "True poses: one file for all estimates or one for each")
        ->required();
    app.add_option("--estimate", estimates, "Estimated poses, one file per robot, or a record")
        ->required();
    app.add_option("--json", json, "Also write the numbers to this file, as JSON");
    app.add_option("--plot", plot,
                   "Also draw truth and estimates from above, as a page for a browser: *.html")
        ->check([](const std::string& file) {
          return file.ends_with(".html")
                     ? ""
                     : file +
                           ": --plot writes *.html (its charts can be saved as *.svg in the "
                           "browser)";
        });
  }

  void run() const {
    check_output_folder(json);
    check_output_folder(plot);
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
    for (const TrajectoryInput& input : inputs)
      if (const std::string difference = difference_of_notation(input); !difference.empty())
        throw std::runtime_error(input.name + " and its truth are written differently: " +
                                 difference + "; a header can name the columns");
    std::cout << to_table(team);
    write_json_output(json, team);
    write_output(plot, [&](std::ostream& out) {
      out << chart_page("Truth and estimates", plot_from_above(inputs, team));
    });
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
  position error  distance to the truth at each pair: the absolute trajectory error
  rotation        rmse of the angle to the truth after the same alignment
  relative        rmse of the error of the motion over a second
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
