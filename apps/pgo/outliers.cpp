#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>

#include "apps/evaluate/stage_progress.hpp"
#include "apps/pgo/commands.hpp"
#include "apps/pgo/outlier_study.hpp"
#include "apps/pgo/truth_score.hpp"
#include "modules/core/json.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

// The seeds of one share and method.
struct Cell {
  std::span<const OutlierResult> results;

  [[nodiscard]] const OutlierResult& any() const { return results.front(); }

  [[nodiscard]] double median(auto OutlierResult::*member) const {
    std::vector<double> values;
    for (const OutlierResult& r : results) values.push_back(static_cast<double>(r.*member));
    return statistics_of(std::move(values)).median;
  }
  [[nodiscard]] auto largest(auto OutlierResult::*member) const {
    return std::ranges::max(results, {}, member).*member;
  }
  [[nodiscard]] std::size_t true_kept() const {
    return std::ranges::min(results, {}, &OutlierResult::true_kept).true_kept;
  }
  [[nodiscard]] bool decided() const {
    return std::ranges::all_of(results, &OutlierResult::decided);
  }
};

std::vector<Cell> cells_of(const OutlierStudy& study) {
  const std::span<const OutlierResult> all(study.results);
  std::vector<Cell> cells;
  for (std::size_t first = 0, k = 1; k <= all.size(); ++k)
    if (k == all.size() || all[k].method != all[first].method ||
        all[k].share_percent != all[first].share_percent) {
      cells.push_back({all.subspan(first, k - first)});
      first = k;
    }
  return cells;
}

// Of methods that find out; nothing if none did.
std::string noise_text(const OutlierStudy& study) {
  if (study.results.empty()) return {};
  const auto [least, most] = std::ranges::minmax(study.results, {}, &OutlierResult::noise_scale);
  if (least.noise_scale == 1.0 && most.noise_scale == 1.0) return {};
  const std::string from = rounded(least.noise_scale, 3);
  const std::string to = rounded(most.noise_scale, 3);
  return "closures found to be " + from + (to == from ? "" : " to " + to) +
         " times as noisy as the file says\n";
}

// A curve per method.
Plot panel(const OutlierStudy& study, const std::string& title, const char* unit, bool log,
           const auto& ordinate) {
  Plot plot{
      .title = title,
      .x_label = "false closures per 100 true ones (" + std::to_string(study.true_closures) + ")",
      .y_label = unit,
      .log_y = log};
  for (const Cell& cell : cells_of(study)) {
    const std::string& method = cell.any().method;
    auto curve = std::ranges::find(plot.series, method, &PlotSeries::name);
    if (curve == plot.series.end())
      curve = plot.series.insert(curve,
                                 {method, {}, plot.series.size(), PlotSeries::Style::kMarkedLine});
    curve->points.push_back({cell.any().share_percent, static_cast<double>(ordinate(cell))});
  }
  return plot;
}

// A row per share and method. Of several seeds the worst, but medians of what they cost.
std::string outlier_text(const OutlierStudy& study) {
  std::vector<std::vector<std::string>> rows{
      {"method", "share", "false", "true kept", "false kept", "rmse m", "rounds", "sent", "CPU s"}};
  bool decided = true;
  for (const Cell& cell : cells_of(study)) {
    decided = decided && cell.decided();
    rows.push_back(
        {cell.any().method, rounded(cell.any().share_percent, 6) + " %",
         std::to_string(cell.any().false_closures), std::to_string(cell.true_kept()),
         std::to_string(cell.largest(&OutlierResult::false_kept)),
         rounded(cell.largest(&OutlierResult::rmse_m), 2),
         std::to_string(cell.largest(&OutlierResult::rounds)) + (cell.decided() ? "" : "+"),
         bytes_text(cell.median(&OutlierResult::bytes)),
         fixed(cell.median(&OutlierResult::cpu_s), 2)});
  }
  std::ostringstream text;
  text << study.poses << " poses, " << study.true_closures << " true closures, " << study.robots
       << (study.robots == 1 ? " robot" : " robots") << "; translations of false closures within "
       << fixed(study.half_side_m, 1) << " m along every axis\n"
       << "rmse: of positions to the optimum of the graph without false closures, which is "
       << (study.certified ? "certified\n" : "NOT certified\n") << noise_text(study)
       << align_columns(rows) << (decided ? "" : "+: came to no end within --rounds\n");
  return text.str();
}

void write_outlier_json(std::ostream& out, const OutlierStudy& study) {
  Json results = Json::array();
  for (const OutlierResult& r : study.results)
    results.push_back({{"method", r.method},
                       {"share_percent", r.share_percent},
                       {"seed", r.seed},
                       {"false_closures", r.false_closures},
                       {"true_kept", r.true_kept},
                       {"false_kept", r.false_kept},
                       {"noise_scale", r.noise_scale},
                       {"rmse_m", r.rmse_m},
                       {"rounds", r.rounds},
                       {"decided", r.decided},
                       {"bytes", r.bytes},
                       {"cpu_s", r.cpu_s}});
  out << json_text({{"poses", study.poses},
                    {"robots", study.robots},
                    {"true_closures", study.true_closures},
                    {"certified", study.certified},
                    {"half_side_m", study.half_side_m},
                    {"results", std::move(results)}});
}

// Error, closures kept, and CPU time against the share of false closures.
std::vector<Plot> outlier_plots(const OutlierStudy& study) {
  return {panel(study, "RMSE of positions to the optimum without false closures", "m", true,
                [](const Cell& cell) { return cell.largest(&OutlierResult::rmse_m); }),
          panel(study, "True closures lost", "closures", false,
                [&](const Cell& cell) { return study.true_closures - cell.true_kept(); }),
          panel(study, "False closures kept", "closures", false,
                [](const Cell& cell) { return cell.largest(&OutlierResult::false_kept); }),
          panel(study, "CPU time of all robots", "s", false,
                [](const Cell& cell) { return cell.median(&OutlierResult::cpu_s); })};
}

constexpr const char* kOutliersDetails =
    "How far do the poses of a team of robots lie from those without any false closure?\n\n"
    "FILE is as in kimera_multi_pgo solve; what it says of which way is up is left out. A share "
    "of\n"
    "30 adds 30 false closures for every 100 true ones: between uniform pairs of poses, with\n"
    "uniform rotation and translation, and the weights of a true closure.\n\n"
    "Methods:\n"
    "  pcm      pairwise consistency: between two robots, and inside one, the largest set of\n"
    "           closures that agree pairwise along the odometry, by exact clique search; then\n"
    "           Newton steps of the team, from odometry, on odometry and these\n"
    "  newton   what the robots run, see solve: the team finds out which closures are false\n"
    "  pcm+newton  the second on what the first leaves\n"
    "  none     Newton steps on everything\n\n"
    "With --clusters there are, beside these, false closures that agree with one another, as\n"
    "between aisles that look alike: between the first robot and the last, at so many places.\n\n"
    "The error is the RMSE of positions to the certified optimum of the graph without false\n"
    "closures, after rigid alignment. Sent is what the robots' solver sends; CPU time is\n"
    "that of all robots together. Of several seeds the\n"
    "worst is shown: fewest true and most false closures kept, largest error, most rounds; of\n"
    "what is sent and of CPU time the median.\n\n"
    "Examples:\n"
    "  kimera_multi_pgo outliers sphere2500.g2o --json out.json --plot out.html\n"
    "  kimera_multi_pgo outliers parking-garage.g2o --shares 30,100,400 --methods newton \\\n"
    "      --seeds 1,2,3\n"
    "  kimera_multi_pgo outliers sphere2500.g2o --shares 0 --clusters 5 --cluster-size 10";

struct OutliersCommand {
  GraphInput input{.robots = 5};
  OutlierStudyOptions study{.shares_percent = {10, 20, 30, 40, 50, 60, 70, 80},
                            .methods = {"pcm", "newton", "pcm+newton"}};
  ReportFiles files;
};

void define(CLI::App& app, OutlierStudyOptions& study) {
  app.add_option("--shares", study.shares_percent, "False closures for every 100 true ones [%]")
      ->check(CLI::Range(0.0, 10000.0))
      ->delimiter(',');
  app.add_option("--methods", study.methods, "See below")
      ->check(CLI::IsMember(kRejections).description(""))
      ->delimiter(',');
  app.add_option("--seeds", study.seeds, "Of the false closures; a run for each")->delimiter(',');
  app.add_option("--outlier-range", study.half_side_m,
                 "Translations of false closures are at most this along every axis [m]; 0: half\n"
                 "the longest side of the map")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--barc", study.barc,
                 "newton: residual [sigma] up to which an edge is kept; 0: the team finds it")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--confidence", study.pcm.confidence,
                 "pcm: share of true cycles that pass the test")
      ->check(CLI::Range(0.01, 1.0 - 1e-12));
  app.add_option("--pcm-sigmas", study.pcm_sigmas,
                 "pcm: sigmas of all edges, in multiples of the file's")
      ->check(CLI::Range(0.01, 1000.0));
  app.add_option("--clusters", study.clusters.places,
                 "Of false closures that agree with each other")
      ->check(CLI::Range(0, 10000));
  app.add_option("--cluster-size", study.clusters.size, "Closures in each")
      ->check(CLI::Range(1, 1000));
  app.add_option("--rounds", study.max_rounds, "At most so many")->check(CLI::Range(1, 1000000));
}

// Without the closures that the file itself labels as false.
TeamGraph true_graph(const LabelledTeamGraph& input, const std::string& file) {
  if (input.truth.is_false.empty()) return input.graph;
  std::vector<ConnectedPart> parts = true_parts(input);
  if (parts.size() > 1)
    throw std::runtime_error(file +
                             ": without the closures labelled false the graph is not connected");
  return std::move(parts.front().graph);
}

void run(const CLI::App& app, const OutliersCommand& command) {
  command.files.check();
  const LabelledTeamGraph input = command.input.read(app);
  TeamGraph graph = true_graph(input, command.input.file.string());
  graph.verticals.clear();
  std::cout << indefinite_text(graph.indefinite_edges);
  StageProgress progress;
  const OutlierStudy study =
      run_outlier_study(graph, command.study, cpu_meter(), [&](std::size_t done, std::size_t all) {
        progress(std::to_string(all) + " runs",
                 static_cast<double>(done) / static_cast<double>(all));
      });
  std::cout << outlier_text(study);
  command.files.write([&](std::ostream& out) { write_outlier_json(out, study); },
                      "Rejecting false closures: " + command.input.file.string(),
                      [&] { return outlier_plots(study); });
}

}  // namespace

void add_outliers(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "outliers", "Adds more and more random false closures and compares what keeps them out");
  app.footer(kOutliersDetails);
  app.option_defaults()->always_capture_default();
  const auto command = std::make_shared<OutliersCommand>();
  command->input.define(app);
  define(app, command->study);
  command->files.define(app, "every run", "error, closures and time");
  app.callback([&app, command] { run(app, *command); });
}

}  // namespace km
