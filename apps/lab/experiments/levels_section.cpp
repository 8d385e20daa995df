#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "apps/lab/experiments/level_results.hpp"
#include "apps/lab/experiments/paper_results.hpp"
#include "apps/lab/experiments/report.hpp"
#include "modules/core/text_table.hpp"

namespace km {
namespace {

constexpr int kMetreDecimals = 3;
constexpr unsigned kUsualLevel = 2;        // a usual robot: the level with numbers to reach
constexpr double kWantedJointShare = 0.5;  // share of the median odometry ATE

// Results of a run with its name.
struct JudgedRun {
  const WorldConfig* world;
  LevelResults results;
};
using Level = std::pair<unsigned, std::string>;  // and LevelWorld::length
using RunsByLevel = std::map<Level, std::vector<JudgedRun>>;

std::string name_of(const Level& level) {
  return std::to_string(level.first) + (level.second.empty() ? "" : ", " + level.second);
}

RunsByLevel runs_by_level(ReportInput& input) {
  RunsByLevel levels;
  for (const LevelRun& run : input.config().level_runs) {
    if (!input.has("team-" + run.world)) continue;
    const WorldConfig& world = input.config().world(run.world);
    levels[{run.level, run.length}].push_back({&world, read_level_results(world, input.paths())});
  }
  return levels;
}

std::size_t joined_of(const std::vector<JudgedRun>& runs) {
  return static_cast<std::size_t>(
      std::ranges::count_if(runs, [](const JudgedRun& run) { return run.results.joined(); }));
}

// Sum of a count over the runs.
std::size_t sum_over(const std::vector<JudgedRun>& runs, const auto& value) {
  std::size_t sum = 0;
  for (const JudgedRun& run : runs) sum += value(run.results);
  return sum;
}

std::vector<double> odometry_of(const std::vector<JudgedRun>& runs) {
  std::vector<double> errors_m;
  for (const JudgedRun& run : runs)
    errors_m.insert(errors_m.end(), run.results.odometry_m.begin(), run.results.odometry_m.end());
  return errors_m;
}

Spread spread_of_known(const std::vector<JudgedRun>& runs, const auto& value) {
  std::vector<double> values;
  for (const JudgedRun& run : runs)
    if (const std::optional<double> known = value(run.results)) values.push_back(*known);
  return spread_of(std::move(values));
}

const auto kBefore = [](const LevelResults& r) { return r.joint_before_m; };
const auto kAfter = [](const LevelResults& r) { return r.joint_after_m; };
const auto kShare_percent = [](const LevelResults& r) {
  return r.equal_keypoints_mb > 0.0
             ? std::optional<double>(100.0 * r.counted_mb / r.equal_keypoints_mb)
             : std::nullopt;
};
const auto kNees = [](const LevelResults& r) { return r.nees; };

std::vector<ReportCell> numbers_row(const std::string& name, const std::vector<JudgedRun>& runs) {
  const auto kept = [](const LevelResults& r) { return r.closures_kept; };
  const auto wrong = [](const LevelResults& r) { return r.false_kept; };
  const auto divergences = [](const LevelResults& r) {
    return static_cast<std::size_t>(r.divergences);
  };
  return {{name},
          {std::to_string(joined_of(runs)) + " of " + std::to_string(runs.size())},
          spread_cell(spread_of(odometry_of(runs)), kMetreDecimals),
          spread_cell(spread_of_known(runs, kBefore), kMetreDecimals),
          spread_cell(spread_of_known(runs, kAfter), kMetreDecimals),
          {std::to_string(sum_over(runs, kept))},
          {std::to_string(sum_over(runs, wrong))},
          spread_cell(spread_of_known(runs, kNees), 2),
          spread_cell(spread_of_known(runs, kShare_percent), 0),
          {std::to_string(sum_over(runs, divergences))}};
}

ReportTable numbers_table(const RunsByLevel& levels) {
  ReportTable table{
      .caption = "Levels of difficulty: medians, and ranges over robots and runs",
      .groups =
          {{"", 2}, {"", 1}, {"joint ATE [m]", 2}, {"closures kept", 2}, {"", 1}, {"", 1}, {"", 1}},
      .columns = {"level", "joined", "odometry ATE [m]", "before", "after", "all", "false",
                  "NEES, median", "bytes [%]", "divergences"}};
  for (const auto& [level, runs] : levels) {
    table.rows.push_back(numbers_row(name_of(level), runs));
    for (const JudgedRun& run : runs) table.rows.push_back(numbers_row(run.world->title, {run}));
  }
  table.note =
      "Joint ATE: RMSE of all robots under one alignment, of runs in which all robots joined. "
      "Before: odometry, placed by the first optimised keyframe of each robot. NEES: of the "
      "published keyframes, over the median of its distribution; 1 is right. Bytes: sent in the "
      "whole run, as a share of those of a server that receives each keyframe with as many "
      "keypoints as the robots receive of a keyframe in the mean. Divergences: found and logged by "
      "the robots.";
  return table;
}

ReportTable angle_table(const RunsByLevel& levels) {
  ReportTable table{.caption = "Recall by viewing angle: pairs of keyframes with a kept closure",
                    .columns = {"level"}};
  for (std::size_t k = 0; k < ClosureScores::kAngleBins; ++k) {
    const double from_deg = ClosureScores::kAngleBin_deg * static_cast<double>(k);
    table.columns.push_back(fixed(from_deg, 0) + " to " +
                            fixed(from_deg + ClosureScores::kAngleBin_deg, 0) + " degrees");
  }
  for (const auto& [level, runs] : levels) {
    std::vector<ReportCell>& row = table.rows.emplace_back();
    row.push_back({name_of(level)});
    for (std::size_t k = 0; k < ClosureScores::kAngleBins; ++k) {
      const std::size_t pairs =
          sum_over(runs, [k](const LevelResults& r) { return r.by_angle[k].true_pairs; });
      const std::size_t found =
          sum_over(runs, [k](const LevelResults& r) { return r.by_angle[k].pairs_found; });
      const double percent = 100.0 * static_cast<double>(found) / static_cast<double>(pairs);
      row.push_back({pairs == 0 ? "-" : fixed(percent, 1) + "% of " + std::to_string(pairs)});
    }
  }
  table.note =
      "Pairs of keyframes of two robots that see the same place by their true poses, whatever "
      "hides it, by the angle between the optical axes.";
  return table;
}

void add_level_targets(const Level& level, const std::vector<JudgedRun>& runs, ReportInput& input) {
  const std::string where = "level " + name_of(level);
  const auto of_all = [&](std::size_t count) {
    return std::to_string(count) + " of " + std::to_string(runs.size());
  };
  const std::size_t joined = joined_of(runs);
  input.add_target({"runs in which all robots joined", where, of_all(runs.size()), of_all(joined),
                    joined == runs.size(), true});
  const Spread share_percent = spread_of_known(runs, kShare_percent);
  if (share_percent.count > 0)
    input.add_target({"communication over as many keypoints as robots receive, worst run", where,
                      "at most " + fixed(kPaperMostShare_percent, 0) + " %",
                      fixed(share_percent.highest, 0) + " %",
                      share_percent.highest <= kPaperMostShare_percent, true});
  const std::size_t wrong = sum_over(runs, [](const LevelResults& r) { return r.false_kept; });
  input.add_target({"false closures kept", where, "0", std::to_string(wrong), wrong == 0, true});
  const double odometry_m = spread_of(odometry_of(runs)).median;
  const Spread joint = spread_of_known(runs, kAfter);
  if (joint.count == 0) return;
  input.add_target({"median joint ATE", where,
                    "at most " + fixed(kWantedJointShare * odometry_m, kMetreDecimals) +
                        " m, half of the median odometry ATE",
                    fixed(joint.median, kMetreDecimals) + " m",
                    joint.median <= kWantedJointShare * odometry_m, true});
}

}  // namespace

std::optional<ReportSection> levels_section(ReportInput& input) {
  const RunsByLevel levels = runs_by_level(input);
  if (levels.empty()) return std::nullopt;
  ReportSection section{.id = "levels", .title = "Worlds that fight back"};
  section.add(ReportParagraph{
      "Levels of difficulty of kimera_multi_simulate: 0 has exact sensors in calm light, 2 those "
      "of a usual robot, 4 everything at its worst. A map is not built."});
  section.add(numbers_table(levels));
  section.add(angle_table(levels));
  for (const auto& [level, runs] : levels)
    if (level.first == kUsualLevel) add_level_targets(level, runs, input);
  return section;
}

}  // namespace km
