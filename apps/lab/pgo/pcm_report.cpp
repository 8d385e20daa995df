#include "apps/lab/pgo/pcm_report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <ostream>

#include "modules/core/json.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

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
  if (run.search != to_string(CliqueMethod::kExact)) return text + '\n';
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

}  // namespace

std::string pcm_text(const PcmRun& run) {
  std::vector<std::vector<std::string>> rows{{"vertices", "clique", "true", "false", "at most",
                                              "search ms", "worst ms", "all s", "check ms",
                                              "all s"}};
  for (const std::size_t size : row_sizes(run.additions.size()))
    rows.push_back(table_row(Additions(run.additions).first(size)));
  return align_columns(rows) + totals_text(run);
}

void write_pcm_json(std::ostream& out, std::span<const PcmRun> runs) {
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
  out << json_text(runs.size() == 1 ? all.front() : all);
}

}  // namespace km
