#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include "apps/lab/pgo/commands.hpp"
#include "apps/lab/pgo/outlier_study.hpp"
#include "apps/lab/pgo/truth_score.hpp"
#include "apps/stage_progress.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/json.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

// Results of all seeds for one share of false closures and one method.
using Cell = std::span<const OutlierResult>;

std::vector<Cell> cells_of(const OutlierStudy& study) {
  const Cell all(study.results);
  std::vector<Cell> cells;
  for (std::size_t first = 0, k = 1; k <= all.size(); ++k)
    if (k == all.size() || all[k].method != all[first].method ||
        all[k].share_percent != all[first].share_percent) {
      cells.push_back(all.subspan(first, k - first));
      first = k;
    }
  return cells;
}

Statistics statistics(Cell cell, auto OutlierResult::*member) {
  std::vector<double> values;
  for (const OutlierResult& r : cell) values.push_back(static_cast<double>(r.*member));
  return statistics_of(std::move(values));
}

std::optional<double> ratio_of(const OutlierStudy& study, const OutlierResult& result) {
  const auto reference = std::ranges::find_if(study.results, [&](const OutlierResult& r) {
    return r.method == "reference" && r.seed == result.seed &&
           r.share_percent == result.share_percent;
  });
  if (reference == study.results.end() || !(reference->rms_m > 0.0)) return std::nullopt;
  return result.rms_m / reference->rms_m;
}

// Median and worst; the value alone of a single seed.
std::string both(const Statistics& values, const auto& text) {
  if (values.count == 1) return text(values.max);
  return text(values.median) + " / " + text(values.max);
}

std::vector<std::string> row_of(const OutlierStudy& study, Cell cell) {
  const OutlierResult& any = cell.front();
  const auto number = [](int digits) {
    return [digits](double value) { return rounded(value, digits); };
  };
  const auto counted = [&](auto OutlierResult::*member) {
    return both(statistics(cell, member), number(6));
  };
  std::vector<double> ratios;
  for (const OutlierResult& r : cell)
    if (const auto ratio = ratio_of(study, r)) ratios.push_back(*ratio);
  const bool decided = std::ranges::all_of(cell, &OutlierResult::decided);
  return {any.method,
          rounded(any.share_percent, 6) + " %",
          counted(&OutlierResult::false_closures),
          counted(&OutlierResult::false_kept),
          counted(&OutlierResult::true_closures),
          counted(&OutlierResult::true_lost),
          counted(&OutlierResult::between_lost),
          counted(&OutlierResult::frames) + (decided ? "" : "+"),
          both(statistics(cell, &OutlierResult::max_m), number(3)),
          both(statistics(cell, &OutlierResult::rms_m), number(3)),
          ratios.empty() ? "-" : both(statistics_of(ratios), number(3)),
          counted(&OutlierResult::rounds),
          both(statistics(cell, &OutlierResult::bytes), bytes_text),
          both(statistics(cell, &OutlierResult::cpu_s), number(2))};
}

// Text with one row per share and method: median and worst of all seeds.
std::string outlier_text(const OutlierStudy& study) {
  std::ostringstream text;
  if (!study.scenario.empty()) text << study.scenario << ": ";
  text << study.poses << " poses, " << study.robots << (study.robots == 1 ? " robot" : " robots")
       << "; the truth is the optimum without false closures, which is "
       << (study.certified ? "certified\n" : "NOT certified\n");
  std::vector<std::vector<std::string>> rows{{"method", "share", "false", "kept", "true", "lost",
                                              "between robots", "frames", "max m", "rms m", "ratio",
                                              "rounds", "sent", "CPU s"}};
  for (const Cell& cell : cells_of(study)) rows.push_back(row_of(study, cell));
  text << align_columns(rows);
  if (!std::ranges::all_of(study.results, &OutlierResult::decided))
    text << "+: came to no end in time\n";
  return text.str();
}

// Every run. "ratio" is null without a reference.
Json to_json(const OutlierStudy& study) {
  Json results = Json::array();
  for (const OutlierResult& r : study.results) {
    const auto ratio = ratio_of(study, r);
    results.push_back({{"method", r.method},
                       {"share_percent", r.share_percent},
                       {"seed", r.seed},
                       {"true_closures", r.true_closures},
                       {"true_lost", r.true_lost},
                       {"between_robots", r.between},
                       {"between_robots_lost", r.between_lost},
                       {"false_closures", r.false_closures},
                       {"false_kept", r.false_kept},
                       {"frames", r.frames},
                       {"max_m", r.max_m},
                       {"rms_m", r.rms_m},
                       {"ratio", ratio ? Json(*ratio) : Json()},
                       {"rounds", r.rounds},
                       {"bytes", r.bytes},
                       {"decided", r.decided},
                       {"cpu_s", r.cpu_s}});
  }
  return {{"scenario", study.scenario},
          {"poses", study.poses},
          {"robots", study.robots},
          {"certified", study.certified},
          {"results", std::move(results)}};
}

std::string details() {
  return R"(Adds false closures, or noise that is not as claimed, and compares what keeps them out

How far are the poses of a team of robots from those without any false closure?

FILE is as in kimera_multi_pgo solve, but its verticals are left out. A share of 30 adds 30
false closures for every 100 true ones. They join uniformly drawn pairs of poses, with
uniform rotation and translation, and the weights of a true closure. The closures of FILE
itself count as true: figures of a FILE with false ones mean nothing.

Methods:
  robots     the robots' own code, from measurements to published poses
  pcm        pairwise consistency: between two robots, and inside one, the largest set of
             closures that agree pairwise along the odometry, by exact clique search;
             then the optimum of odometry and these closures, on one computer
  trust-all  all closures, on one computer
  reference  only the true closures, weighed by the noise that was drawn

The error is that of positions to the certified optimum of the graph without false
closures, after rigid alignment. If a method leaves robots in several frames, each frame
is aligned separately. The ratio is the RMS error divided by that of the reference. With
several seeds, the table shows the median and the worst. CPU time is that of all robots
together.

Scenarios: the optimum of FILE is the truth, and each seed draws odometry and closures
around it. Scenarios, and the graph each is meant for:
)" + scenario_list() +
         R"(
Examples:
  kimera_multi_pgo outliers sphere2500.g2o --json out.json
  kimera_multi_pgo outliers parking-garage.g2o --shares 30,100,400 --methods robots \
      --seeds 1,2,3
  kimera_multi_pgo outliers sphere2500.g2o --scenario noisy-odometry --seeds 1,2,3)";
}

// The graph without the closures that the file labels as false.
TeamGraph true_graph(const LabelledTeamGraph& input, const std::string& file) {
  if (input.truth.is_false.empty()) return input.graph;
  std::vector<ConnectedPart> parts = true_parts(input);
  if (parts.size() > 1)
    throw std::runtime_error(file +
                             ": without the closures labelled false the graph is not connected");
  return std::move(parts.front().graph);
}

struct OutliersCommand {
  GraphInput input{.robots = 5};
  std::string scenario = {};
  std::vector<double> shares_percent = {};  // empty: the default
  std::vector<std::string> methods = {};
  std::vector<unsigned> seeds = {};
  std::filesystem::path json = {};

  void define(CLI::App& app) {
    app.option_defaults()->always_capture_default();
    input.define(app);
    std::vector<std::string> names;
    for (const Scenario& one : scenarios()) names.push_back(one.name);
    app.add_option("--scenario", scenario, "See above; with the scenario's own robots")
        ->check(CLI::IsMember(names).description(""));
    app.add_option("--shares", shares_percent,
                   "False closures for every 100 true ones [%]. The default is 10,20,...,80; in a\n"
                   "scenario its own share")
        ->check(CLI::Range(0.0, 10000.0))
        ->delimiter(',');
    app.add_option("--methods", methods,
                   "See above. The default is pcm,robots; in a scenario\n"
                   "robots,trust-all,pcm,reference")
        ->check(CLI::IsMember(kRejections).description(""))
        ->delimiter(',');
    app.add_option(
           "--seeds", seeds,
           "Seeds of the false closures, one run each. The default is 1; in a scenario 1 to\n"
           "10")
        ->delimiter(',');
    app.add_option("--json", json, "Also write every run to this file, as JSON");
  }

  void run() const {
    check_output_folder(json);
    GraphInput graph_input = input;
    OutlierStudyOptions study = with_defaults();
    if (study.scenario) {
      graph_input.keep_steps = true;
      if (study.scenario->robots > 0) graph_input.robots = 1;
    }
    TeamGraph graph = true_graph(graph_input.read(), input.file.string());
    graph.verticals.clear();
    std::cout << indefinite_text(graph.indefinite_edges);
    StageProgress progress;
    const OutlierStudy done =
        run_outlier_study(graph, study, cpu_meter(), [&](std::size_t ended, std::size_t all) {
          progress(std::to_string(all) + " runs",
                   static_cast<double>(ended) / static_cast<double>(all));
        });
    std::cout << outlier_text(done);
    write_json_output(json, to_json(done));
  }

 private:
  [[nodiscard]] OutlierStudyOptions with_defaults() const {
    OutlierStudyOptions study{.shares_percent = {10, 20, 30, 40, 50, 60, 70, 80},
                              .methods = {"pcm", "robots"}};
    if (!scenario.empty()) {
      study = {.scenario = scenario_of(scenario),
               .methods = {"robots", "trust-all", "pcm", "reference"},
               .seeds = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}};
      study.scenario->keep_steps = input.keep_steps;
      if (input.robots_given) study.scenario->robots = input.robots;
      if (is_folder(input.file)) study.scenario->robots = 0;
    }
    if (!shares_percent.empty()) study.shares_percent = shares_percent;
    if (!methods.empty()) study.methods = methods;
    if (!seeds.empty()) study.seeds = seeds;
    return study;
  }
};

}  // namespace

void add_outliers(CLI::App& app) {
  add_command<OutliersCommand>(app, "outliers", details());
}

}  // namespace km
