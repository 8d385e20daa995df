#include <algorithm>
#include <cmath>

#include "apps/lab/experiments/paper_results.hpp"
#include "apps/lab/experiments/report.hpp"
#include "modules/core/text_table.hpp"

namespace km {
namespace {

constexpr double kMostRbcdGap_percent = 7.0;  // largest gap in the paper
constexpr double kMostDrift_percent = 0.5;

double error_m(const PgoNumbers& numbers) {
  return numbers.error_m.value_or(NAN);
}

double published_m(const WorldResults* results) {
  return results == nullptr ? NAN : results->joint_error_m.value_or(NAN);
}

// Rounding moves the cost of the optimum itself slightly below or above.
double gap_percent(const PgoNumbers& numbers) {
  const double percent = 100.0 * (numbers.cost / numbers.optimum - 1.0);
  return percent < 0.0 ? 0.0 : percent;
}

ReportTable inputs_table(const std::vector<ReportInput::World>& worlds) {
  ReportTable table{.caption = "The inputs",
                    .columns = {"world", "robots", "images", "time of each [s]", "distance [m]",
                                "closures kept", "of them true"}};
  for (const auto& [config, results] : worlds) {
    std::string times, distances;
    for (const RobotNumbers& robot : results->robots) {
      if (!robot.in_team_frame)
        table.note += config->title + ": " + robot.name +
                      " never met the others; it is not judged with them, pictures show it in a "
                      "frame of its own, and there is no solution for all together. ";
      times += (times.empty() ? "" : ", ") + fixed(robot.recorded_s, 0);
      distances += (distances.empty() ? "" : ", ") + fixed(robot.distance_m, 0);
    }
    table.rows.push_back({{config->title},
                          {std::to_string(results->robots.size())},
                          {results->images},
                          {times},
                          {distances},
                          {number_text(results->closures, 0)},
                          {number_text(results->true_closures, 0)}});
  }
  return table;
}

// Marks the best distributed method, as in the paper, and those with the same text.
void mark_best(std::vector<ReportCell>& row, const std::vector<double>& values) {
  const auto best = std::min_element(values.begin(), values.end());
  if (best == values.end() || !std::isfinite(*best)) return;
  const std::string text = row[static_cast<std::size_t>(best - values.begin()) + 1].text;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (std::isfinite(values[k]) && row[k + 1].text == text)
      row[k + 1].style = ReportCell::Style::kBest;
}

// One half of Table I: a value per world and method.
ReportTable half_table(ReportInput& input, const std::vector<ReportInput::World>& worlds,
                       bool error) {
  ReportTable table{.caption = error ? "Table I: absolute trajectory error of the keyframes [m]"
                                     : "Table I: cost of pose graph optimisation",
                    .columns = {"world"}};
  if (error)
    table.columns.insert(table.columns.end(),
                         {"published by the robots", "published, PCM then RBCD", "live"});
  for (const PgoMethodConfig& method : input.config().methods)
    table.columns.push_back(method.title);
  for (const auto& world : worlds) {
    const PaperWorld* const paper = paper_world(world.config->name);
    std::vector<ReportCell> row{{world.config->title}};
    std::vector<double> distributed;
    if (error)
      for (const WorldResults* results : {world.results, input.paper_run(*world.config)}) {
        const double value = published_m(results);
        row.push_back({significant(value, 3)});
        distributed.push_back(std::isfinite(value) ? value : INFINITY);
      }
    if (error) {
      row.push_back({number_text(world.results->live_error_m, 3)});
      distributed.push_back(INFINITY);  // it is not compared with corrected poses
    }
    for (const PgoMethodConfig& method : input.config().methods) {
      const double value = of_method(input, world, method.name, [&](const PgoNumbers& pgo) {
        return error ? error_m(pgo) : pgo.cost;
      });
      ReportCell& cell = row.emplace_back(ReportCell{significant(value, error ? 3 : 5)});
      if (const auto column = paper_column(method.name); paper != nullptr && column)
        cell.paper = paper_text(error ? paper->ate_m[*column] : paper->cost[*column]);
      const bool counts = method.name != "centralized" && std::isfinite(value);
      distributed.push_back(counts ? value : INFINITY);
    }
    mark_best(row, distributed);
    table.rows.push_back(std::move(row));
  }
  table.note =
      error ? "Of all robots under one alignment, rmse. The best distributed result is "
              "bold; the paper's centralised one is SE-Sync. Published by the robots: "
              "their optimized.tum at the end of the run, a pose for every image. Live: their "
              "live.tum, the pose known when each image came, since the robots joined."
            : "Chordal cost of rigid poses without 1/2, weights as SE-Sync reads them. "
              "Costs of two worlds cannot be compared: they grow with the number of "
              "closures and with what these claim of their accuracy. A method that rejects "
              "closures has none.";
  return table;
}

// The centralised method finds the optimum itself. The default has another cost, without the
// closures that it rejects.
bool has_gap(const PgoMethodConfig& method) {
  return method.name != "centralized" && method.name != "newton";
}

ReportTable gap_table(ReportInput& input, const std::vector<ReportInput::World>& worlds) {
  ReportTable table{.caption = "Cost above the centralised optimum [%]", .columns = {"world"}};
  for (const PgoMethodConfig& method : input.config().methods)
    if (has_gap(method)) table.columns.push_back(method.title);
  for (const auto& world : worlds) {
    const PaperWorld* const paper = paper_world(world.config->name);
    std::vector<ReportCell> row{{world.config->title}};
    for (const PgoMethodConfig& method : input.config().methods) {
      if (!has_gap(method)) continue;
      ReportCell& cell = row.emplace_back(
          ReportCell{significant(of_method(input, world, method.name, gap_percent), 2)});
      if (const auto column = paper_column(method.name); paper != nullptr && column)
        cell.paper = significant(100.0 * (paper->cost[*column] / paper->cost.back() - 1.0), 2);
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

ReportFigures plots(ReportInput& input, const std::vector<ReportInput::World>& worlds) {
  ReportFigures row;
  for (const auto& world : worlds)
    for (const PgoMethodConfig& method : input.config().methods) {
      if (method.name != "local" && method.name != "newton") continue;
      const PgoNumbers* const pgo = input.pgo(*world.config, method);
      if (pgo == nullptr || !pgo->plot) continue;
      row.figures.push_back({.name = "trajectory-" + world.config->name + '-' + method.name,
                             .caption = world.config->title + ", " + method.title +
                                        ": keyframes from above, truth in grey.",
                             .plots = {*pgo->plot}});
    }
  return row;
}

ReportTable odometry_table(const std::vector<ReportInput::World>& worlds) {
  ReportTable table{
      .caption = "Odometry alone, and what the team makes of it",
      .groups = {{"", 2}, {"odometry, aligned alone", 2}, {"in the team", 1}},
      .columns = {"robot", "distance [m]", "ATE [m]", "ATE / distance [%]", "ATE [m]"}};
  for (const auto& [config, results] : worlds)
    for (const RobotNumbers& robot : results->robots) {
      const auto published = published_odometry_error_m(robot.name);
      std::optional<double> share;
      if (robot.odometry_error_m && robot.distance_m > 0.0)
        share = 100.0 * *robot.odometry_error_m / robot.distance_m;
      table.rows.push_back({{config->title + ", " + robot.name},
                            {fixed(robot.distance_m, 0)},
                            {number_text(robot.odometry_error_m, 3),
                             published ? fixed(*published, 2) : std::string()},
                            {number_text(share, 3)},
                            {number_text(robot.optimized_error_m, 3)}});
    }
  table.note = "Of every image, rmse. In grey: as published for Kimera-VIO on the original images.";
  return table;
}

// Worlds whose team was run more than once.
ReportTable trajectory_spread_table(ReportInput& input,
                                    const std::vector<ReportInput::World>& worlds) {
  ReportTable table{.caption = "How much runs differ: median, and lowest to highest",
                    .groups = {{"", 2}, {"ATE [m]", 3}, {"", 3}},
                    .columns = {"world", "runs", "published by the robots", "local PGO", "RBCD",
                                "RBCD: gap [%]", "odometry: mean ATE [m]", "closures kept"}};
  for (const auto& world : worlds) {
    const std::vector<ReportInput::World> runs = input.runs_of(*world.config);
    if (runs.size() < 2) continue;
    const auto error = [&](const char* method) {
      return spread_cell(
          spread_over(runs, [&](auto& run) { return of_method(input, run, method, error_m); }), 4);
    };
    const auto published = [](auto& run) { return published_m(run.results); };
    const auto gap = [&](auto& run) { return of_method(input, run, "rbcd", gap_percent); };
    const auto odometry_m = [](const auto& run) {
      double sum_m = 0.0;
      for (const RobotNumbers& robot : run.results->robots)
        sum_m += robot.odometry_error_m.value_or(NAN);
      return sum_m / static_cast<double>(run.results->robots.size());
    };
    const auto closures = [](const auto& run) { return run.results->closures.value_or(NAN); };
    table.rows.push_back({{world.config->title},
                          {std::to_string(runs.size())},
                          spread_cell(spread_over(runs, published), 4),
                          error("local"),
                          error("rbcd"),
                          spread_cell(spread_over(runs, gap), 4),
                          spread_cell(spread_over(runs, odometry_m), 4),
                          spread_cell(spread_over(runs, closures), 0)});
  }
  table.note =
      "The tables above are of the first run. Further runs are on the same recordings, or on those "
      "of another seed of the world (worlds.yaml: runs, seeds), without a map. Robots are "
      "processes that meet when they do, so no two runs are the same.";
  return table;
}

// Trajectories are judged by the median of all runs, costs by the highest.
void add_optimisation_targets(ReportInput& input, const ReportInput::World& world) {
  const std::vector<ReportInput::World> runs = input.runs_of(*world.config);
  const PaperWorld* const paper = paper_world(world.config->name);
  const auto add_ratio = [&](const char* what, const auto& ours_m) {
    const Spread ratio = spread_over(
        runs, [&](auto& run) { return ours_m(run) / of_method(input, run, "local", error_m); });
    if (ratio.count == 0 || paper == nullptr) return;
    const double wanted = paper->ate_m[1] / paper->ate_m[0];
    input.add_target({std::string("ATE of ") + what + " over that of local PGO",
                      world.config->title, "at most " + fixed(wanted, 2) + ", the paper's",
                      fixed(ratio.median, 2) + range_text(ratio, 2), ratio.median <= wanted, true});
  };
  add_ratio("RBCD", [&](auto& run) { return of_method(input, run, "rbcd", error_m); });
  add_ratio("what the robots published", [](auto& run) { return published_m(run.results); });
  const Spread gap =
      spread_over(runs, [&](auto& run) { return of_method(input, run, "rbcd", gap_percent); });
  if (gap.count == 0) return;
  input.add_target({"cost of RBCD above the optimum", world.config->title,
                    "at most " + paper_text(kMostRbcdGap_percent) + " %",
                    significant(gap.highest, 2) + " %", gap.highest <= kMostRbcdGap_percent});
}

void add_odometry_targets(ReportInput& input, const ReportInput::World& world) {
  for (const RobotNumbers& robot : world.results->robots) {
    if (!robot.odometry_error_m) continue;
    const std::string where = world.config->title + ", " + robot.name;
    if (const auto most_m = published_odometry_error_m(robot.name)) {
      input.add_target({"ATE of odometry", where, "at most " + fixed(*most_m, 2) + " m",
                        fixed(*robot.odometry_error_m, 3) + " m",
                        *robot.odometry_error_m <= *most_m, true});
    } else if (robot.distance_m > 0.0) {
      const double percent = 100.0 * *robot.odometry_error_m / robot.distance_m;
      input.add_target({"ATE of odometry over the distance", where, "at most 0.5 %",
                        fixed(percent, 3) + " %", percent <= kMostDrift_percent, true});
    }
  }
}

}  // namespace

std::optional<ReportSection> trajectory_section(ReportInput& input) {
  const auto worlds = input.worlds(input.config().trajectory_worlds);
  if (worlds.empty()) return std::nullopt;
  ReportSection section{.id = "trajectory", .title = "Trajectories"};
  section.add(ReportParagraph{
      "A team runs in each world. The first columns have the trajectories that its robots "
      "published "
      "at the end of the run: by their defaults, and in one more run by the paper's own pipeline, "
      "consistent closures by PCM and then RBCD. The pose graph that the team ends with by its "
      "defaults, odometry and the closures it kept, is also solved by every method: local PGO "
      "joins "
      "the robots' own solutions by one closure each; RBCD, RBCD stopped after 50 rounds and DGS "
      "see only their robot's part and the messages of the others; the centralised one certifies "
      "its optimum. RBCD, DGS and the centralised one start from the chordal initialisation of the "
      "whole graph, which one computer makes and nobody counts, and do without the verticals that "
      "robots know, as the paper's do. The default, Newton's method, starts from odometry as the "
      "robots do, weighs the closures, and uses the verticals."});
  section.add(inputs_table(worlds));
  section.add(half_table(input, worlds, true));
  section.add(half_table(input, worlds, false));
  section.add(gap_table(input, worlds));
  section.add(plots(input, worlds));
  section.add(odometry_table(worlds));
  section.add(trajectory_spread_table(input, worlds));
  for (const auto& world : worlds) add_optimisation_targets(input, world);
  for (const auto& world : worlds) add_odometry_targets(input, world);
  return section;
}

}  // namespace km
