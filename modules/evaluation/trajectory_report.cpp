#include "modules/evaluation/trajectory_report.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "modules/core/text_table.hpp"

namespace km {
namespace {

std::vector<std::string> table_row(const TrajectoryError& e) {
  const auto rmse = [](const Statistics& errors, int decimals) {
    return errors.count > 0 ? fixed(errors.rmse, decimals) : "-";
  };
  return {e.name,
          std::to_string(e.position_m.count),
          fixed(e.position_m.rmse, 4),
          fixed(e.position_m.mean, 4),
          fixed(e.position_m.median, 4),
          fixed(e.position_m.max, 4),
          fixed(e.rotation_deg.rmse, 3),
          rmse(e.rpe_translation_m, 4),
          rmse(e.rpe_rotation_deg, 3),
          fixed(100.0 * e.completeness, 1) + '%'};
}

bool lacks_relative(const TrajectoryError& error) {
  return error.rpe_translation_m.count == 0;
}

// Null for the statistics of an empty sample, because zeros would be perfect scores.
Json to_json(const Statistics& statistics) {
  const auto number = [&](double value) { return statistics.count > 0 ? Json(value) : Json(); };
  return {{"rmse", number(statistics.rmse)},
          {"mean", number(statistics.mean)},
          {"median", number(statistics.median)},
          {"max", number(statistics.max)},
          {"count", statistics.count}};
}

Json to_json(const Alignment& alignment) {
  const Eigen::Vector3d t = alignment.T_truth_estimate.translation();
  const Eigen::Quaterniond q(alignment.T_truth_estimate.linear());
  return {{"scale", alignment.scale},
          {"translation_m", {t.x(), t.y(), t.z()}},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

}  // namespace

std::string to_table(const TeamError& team) {
  std::vector<std::vector<std::string>> rows = {
      {"", "", "position", "error [m]", "", "", "rotation", "relative,", "per delta"},
      {"estimate", "pairs", "rmse", "mean", "median", "max", "rmse[deg]", "rmse[m]", "rmse[deg]",
       "covered"}};
  for (const TrajectoryError& robot : team.robots) rows.push_back(table_row(robot));
  if (team.robots.size() > 1) rows.push_back(table_row(team.joint));
  std::string text = align_columns(rows);
  if (std::any_of(team.robots.begin(), team.robots.end(), lacks_relative))
    text += "-: no two compared poses lie one delta apart, so there is no relative error\n";
  return text;
}

void to_json(Json& json, const TrajectoryError& error) {
  json = {{"name", error.name},
          {"poses", error.poses},
          {"pairs", error.position_m.count},
          {"completeness", error.completeness},
          {"position_m", to_json(error.position_m)},
          {"rotation_deg", to_json(error.rotation_deg)},
          {"rpe_translation_m", to_json(error.rpe_translation_m)},
          {"rpe_rotation_deg", to_json(error.rpe_rotation_deg)},
          {"segment_lengths_m", error.segment_lengths_m},
          {"drift_percent", to_json(error.drift_percent)},
          {"drift_deg_per_m", to_json(error.drift_deg_per_m)}};
}

void to_json(Json& json, const TeamError& team) {
  json = {{"alignment", to_json(team.alignment)}, {"robots", team.robots}, {"joint", team.joint}};
}

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

}  // namespace

Plot plot_from_above(std::span<const TrajectoryInput> inputs, const TeamError& team) {
  Plot plot{.title = "From above", .is_map = true, .series = truth_series(inputs)};
  for (std::size_t r = 0; r < inputs.size(); ++r) {
    PlotSeries& series = plot.series.emplace_back();
    series.name = team.robots[r].name + ", position rmse " +
                  rounded(team.robots[r].position_m.rmse, 3) + " m";
    series.colour = r;
    series.width_px = 1.2;
    for (const StampedPose& pose : inputs[r].estimate)
      series.points.push_back(from_above(team.alignment.apply(pose.T)));
  }
  return plot;
}

}  // namespace km
