#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/lab/pgo/commands.hpp"
#include "apps/lab/pgo/pcm_run.hpp"
#include "apps/stage_progress.hpp"
#include "modules/core/io/json.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr int kMostClosures = 100000;

constexpr const char* kPcmDetails =
    R"(Adds loop closures one at a time and follows the largest set that agrees

Pairwise consistency maximisation (PCM): the closures are vertices of a consistency graph,
and its maximum clique is the set to be trusted.

FILE is one robot's pose graph (g2o), 2D or 3D. --outliers adds random closures to those of the
file, which count as true.

Two closures are consistent if the cycle through them and the odometry between them is the
identity up to noise: its squared Mahalanobis distance is within the 99 % quantile of
chi-squared with 6 degrees of freedom. Closures that contradict odometry alone are dropped
before.

Searches:
  exact        the proven maximum after every addition: branch and bound among the new
               vertex's neighbours, within a bound
  incremental  greedy from the new vertex only (the heuristic of Kimera-Multi)
  batch        greedy from every vertex, from scratch at every addition

The table shows, at growing sizes of the graph: the clique, its true members of all true
closures so far, its false ones, the bound on the maximum that is proven, the median time
of the last 50 searches, the worst search and their sum, the median time of the last 50
rounds of checks and their sum. Times are CPU times of one thread.

Examples:
  kimera_multi_pgo pcm manhattan.g2o --outliers 1000 --seed 1 --json pcm.json
  kimera_multi_pgo pcm manhattan.g2o --outliers 1000 --search exact incremental batch)";

constexpr std::size_t kRows = 10;
constexpr std::size_t kWindow = 50;  // number of additions per median

using Additions = std::span<const PcmAddition>;

std::vector<double> values(Additions additions, double PcmAddition::*member) {
  std::vector<double> result;
  for (const PcmAddition& addition : additions) result.push_back(addition.*member);
  return result;
}

double total(Additions additions, double PcmAddition::*member) {
  const std::vector<double> all = values(additions, member);
  return std::accumulate(all.begin(), all.end(), 0.0);
}

double median_ms(Additions additions, double PcmAddition::*member) {
  return 1e3 * statistics_of(values(additions, member)).median;
}

// Sizes of the graph at which the table has a row: round numbers, and the last size.
std::vector<std::size_t> row_sizes(std::size_t vertices) {
  std::size_t step = 1;
  for (const std::size_t next :
       {2U, 5U, 10U, 20U, 50U, 100U, 250U, 500U, 1000U, 2000U, 5000U, 10000U})
    if (step * kRows < vertices) step = next;
  std::vector<std::size_t> sizes;
  for (std::size_t size = step; size < vertices; size += step) sizes.push_back(size);
  if (vertices > 0) sizes.push_back(vertices);
  return sizes;
}

std::vector<std::string> table_row(Additions until) {
  const PcmAddition& now = until.back();
  const Additions recent = until.last(std::min(kWindow, until.size()));
  return {std::to_string(now.vertices),
          std::to_string(now.clique),
          std::to_string(now.true_members) + '/' + std::to_string(now.true_vertices),
          std::to_string(now.clique - now.true_members),
          std::to_string(now.bound),
          fixed(median_ms(recent, &PcmAddition::search_s), 3),
          fixed(1e3 * statistics_of(values(until, &PcmAddition::search_s)).max, 3),
          fixed(total(until, &PcmAddition::search_s), 3),
          fixed(median_ms(recent, &PcmAddition::check_s), 3),
          fixed(total(until, &PcmAddition::check_s), 3)};
}

std::string totals_text(const PcmRun& run) {
  const auto n = static_cast<double>(run.additions.size());
  const double density = n > 1.0 ? 2.0 * static_cast<double>(run.edges) / (n * (n - 1.0)) : 0.0;
  std::string text = run.search + " search: " + std::to_string(run.edges) +
                     " consistent pairs, density " + fixed(density, 3);
  if (run.dropped_true + run.dropped_false > 0)
    text += "; contradicted odometry and dropped: " + std::to_string(run.dropped_true) + " true, " +
            std::to_string(run.dropped_false) + " false";
  if (run.search != "exact") return text + '\n';
  text += "; " + std::to_string(run.search_nodes) + " search nodes\n";
  if (run.searches_ended > 0)
    text += std::to_string(run.searches_ended) +
            " additions ended at the bound of nodes and fell back to the heuristic\n";
  const auto unproven = std::count_if(run.additions.begin(), run.additions.end(),
                                      [](const auto& a) { return a.clique < a.bound; });
  return text + (unproven == 0
                     ? "the clique was a maximum at every step, proven\n"
                     : "no proof of a maximum after " + std::to_string(unproven) + " additions\n");
}

// Table of the run at about ten sizes of its graph, and its totals.
std::string pcm_text(const PcmRun& run) {
  std::vector<std::vector<std::string>> rows{{"vertices", "clique", "true", "false", "at most",
                                              "search ms", "worst ms", "all s", "check ms",
                                              "all s"}};
  for (const std::size_t size : row_sizes(run.additions.size()))
    rows.push_back(table_row(Additions(run.additions).first(size)));
  return align_columns(rows) + totals_text(run);
}

// "true_members" and "false_members" count the closures of the clique by label. One run is an
// object, several are an array.
Json to_json(std::span<const PcmRun> runs) {
  Json all = Json::array();
  for (const PcmRun& run : runs) {
    Json additions = Json::array();
    for (const PcmAddition& a : run.additions)
      additions.push_back({{"vertices", a.vertices},
                           {"check_s", a.check_s},
                           {"search_s", a.search_s},
                           {"clique", a.clique},
                           {"true_members", a.true_members},
                           {"false_members", a.clique - a.true_members}});
    all.push_back({{"search", run.search}, {"additions", std::move(additions)}});
  }
  return runs.size() == 1 ? all.front() : all;
}

struct PcmCommand {
  fs::path file;
  fs::path json;
  std::vector<std::string> searches{"exact"};
  ClosureChoice selection;

  void define(CLI::App& app) {
    app.option_defaults()->always_capture_default();
    app.add_option("FILE", file, "Pose graph of one robot (*.g2o)")->required();
    app.add_option("--search", searches, "exact, incremental or batch; several are compared")
        ->check(CLI::IsMember(kSearches).description(""));
    app.add_option("--outliers", selection.outliers, "Random false closures to add")
        ->check(CLI::Range(0, kMostClosures));
    app.add_option("--closures", selection.keep,
                   "Number of the file's closures to use, drawn at random; 0: all")
        ->check(CLI::Range(0, kMostClosures));
    app.add_option("--seed", selection.seed, "Seed of all random draws");
    app.add_option("--json", json,
                   "Also write every addition to this file, as JSON (an array for several "
                   "searches)");
  }

  // Does one run per search, and prints each as soon as it has ended.
  void run() const {
    check_output_folder(json);
    const auto [closures, indefinite] = read_closures(file, selection);
    const auto outliers = std::ranges::count(closures, true, &LabelledClosure::outlier);
    std::cout << closures.size() << " closures, " << outliers << " of them false\n"
              << indefinite_text(indefinite);
    std::vector<PcmRun> runs;
    for (const std::string& search : searches) {
      StageProgress progress;
      runs.push_back(run_pcm(closures, search, [&](std::size_t done) {
        progress(search + " search",
                 static_cast<double>(done) / static_cast<double>(closures.size()));
      }));
      std::cout << '\n' << pcm_text(runs.back()) << std::flush;
    }
    write_json_output(json, to_json(runs));
  }
};

}  // namespace

void add_pcm(CLI::App& app) {
  add_command<PcmCommand>(app, "pcm", kPcmDetails);
}

}  // namespace km
