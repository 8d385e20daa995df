#include "apps/pcm/pcm_report.hpp"

#include <algorithm>
#include <limits>
#include <ostream>
#include <utility>
#include <vector>

#include "apps/team/text_table.hpp"
#include "modules/core/json_writer.hpp"
#include "modules/evaluation/curve_plot.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

constexpr std::size_t kRows = 10;
constexpr std::size_t kWindow = 50;  // additions that a median is over

using Additions = std::span<const PcmAddition>;

std::vector<double> values(Additions additions, double PcmAddition::*member) {
  std::vector<double> result;
  for (const PcmAddition& addition : additions) result.push_back(addition.*member);
  return result;
}

double total(Additions additions, double PcmAddition::*member) {
  double sum = 0.0;
  for (const PcmAddition& addition : additions) sum += addition.*member;
  return sum;
}

double greatest(Additions additions, double PcmAddition::*member) {
  double most = 0.0;
  for (const PcmAddition& addition : additions) most = std::max(most, addition.*member);
  return most;
}

std::string ms(double s) {
  return fixed(1e3 * s, 3);
}

// Sizes at which the table has a row: round numbers, and the last.
std::vector<std::size_t> row_sizes(std::size_t vertices) {
  std::size_t step = 1;
  for (const std::size_t next : {2, 5, 10, 20, 50, 100, 250, 500, 1000, 2000, 5000, 10000})
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
          now.true_members
              ? std::to_string(*now.true_members) + '/' + std::to_string(*now.true_vertices)
              : "-",
          now.true_members ? std::to_string(now.clique - *now.true_members) : "-",
          std::to_string(now.bound),
          ms(statistics_of(values(recent, &PcmAddition::search_s)).median),
          ms(greatest(until, &PcmAddition::search_s)),
          fixed(total(until, &PcmAddition::search_s), 3),
          ms(statistics_of(values(recent, &PcmAddition::check_s)).median),
          fixed(total(until, &PcmAddition::check_s), 3)};
}

std::string totals_text(const PcmRun& run) {
  const auto n = static_cast<double>(run.additions.size());
  const double density = n > 1.0 ? 2.0 * static_cast<double>(run.edges) / (n * (n - 1.0)) : 0.0;
  std::string text = to_string(run.search) + " search: " + std::to_string(run.edges) +
                     " consistent pairs, density " + fixed(density, 3);
  if (run.dropped_true + run.dropped_false > 0)
    text += "; contradicted odometry and dropped: " + std::to_string(run.dropped_true) + " true, " +
            std::to_string(run.dropped_false) + " false";
  if (run.search != CliqueMethod::kExact) return text + '\n';
  text += "; " + std::to_string(run.search_nodes) + " search nodes\n";
  if (run.searches_ended > 0)
    text += std::to_string(run.searches_ended) +
            " additions ended at --max-search-nodes and fell back to the heuristic\n";
  const auto unproven = std::count_if(run.additions.begin(), run.additions.end(),
                                      [](const auto& a) { return a.clique < a.bound; });
  return text + (unproven == 0
                     ? "the clique was a maximum at every step, proven\n"
                     : "no proof of a maximum after " + std::to_string(unproven) + " additions\n");
}

// Medians over the additions around every point: single times are noise.
std::vector<CurvePoint> running_median_ms(Additions additions, double PcmAddition::*member) {
  std::vector<CurvePoint> points;
  for (std::size_t n = 0; n < additions.size(); n += kWindow / 5) {
    const std::size_t first = n - std::min(n, kWindow / 2);
    const Additions around = additions.subspan(first, std::min(kWindow, additions.size() - first));
    points.push_back({static_cast<double>(additions[n].vertices),
                      1e3 * statistics_of(values(around, member)).median});
  }
  return points;
}

std::vector<CurvePoint> each_ms(Additions additions, double PcmAddition::*member) {
  std::vector<CurvePoint> points;
  for (const PcmAddition& a : additions)
    points.push_back({static_cast<double>(a.vertices), 1e3 * (a.*member)});
  return points;
}

std::vector<CurvePoint> sizes(Additions additions) {
  std::vector<CurvePoint> points;
  for (const PcmAddition& a : additions)
    points.push_back({static_cast<double>(a.vertices), static_cast<double>(a.clique)});
  return points;
}

std::vector<CurvePoint> true_vertices(Additions additions) {
  std::vector<CurvePoint> points;
  for (const PcmAddition& a : additions)
    if (a.true_vertices)
      points.push_back({static_cast<double>(a.vertices), static_cast<double>(*a.true_vertices)});
  return points;
}

void write_members(JsonWriter& json, const PcmAddition& a) {
  constexpr double kNull = std::numeric_limits<double>::quiet_NaN();  // as JsonWriter has it
  if (!a.true_members) {
    json.field("true_members", kNull);
    json.field("false_members", kNull);
    return;
  }
  json.field("true_members", *a.true_members);
  json.field("false_members", a.clique - *a.true_members);
}

}  // namespace

std::string pcm_text(const PcmRun& run) {
  std::vector<std::vector<std::string>> rows{{"vertices", "clique", "true", "false", "at most",
                                              "search ms", "worst ms", "all s", "check ms",
                                              "all s"}};
  const Additions additions(run.additions);
  for (const std::size_t size : row_sizes(additions.size()))
    rows.push_back(table_row(additions.first(size)));
  return align_columns(rows) + totals_text(run);
}

void write_pcm_json(std::ostream& out, std::span<const PcmRun> runs) {
  JsonWriter json(out);
  if (runs.size() != 1) json.begin_array();
  for (const PcmRun& run : runs) {
    json.begin_object();
    json.field("search", to_string(run.search));
    json.key("additions");
    json.begin_array();
    for (const PcmAddition& a : run.additions) {
      json.begin_object();
      json.field("vertices", a.vertices);
      json.field("check_s", a.check_s);
      json.field("search_s", a.search_s);
      json.field("clique", a.clique);
      write_members(json, a);
      json.end_object();
    }
    json.end_array();
    json.end_object();
  }
  if (runs.size() != 1) json.end_array();
}

std::string pcm_plot(std::span<const PcmRun> runs) {
  CurvePanel time{.title = "CPU time of one addition: each, and the median of 50",
                  .x_label = "vertices",
                  .y_label = "ms",
                  .log_y = true,
                  .curves = {}};
  CurvePanel size{.title = "Size of the clique",
                  .x_label = "vertices",
                  .y_label = "closures",
                  .log_y = false,
                  .curves = {}};
  for (const PcmRun& run : runs) {
    const std::string name = to_string(run.search);
    const std::size_t colour = time.curves.size() / 2;
    time.curves.push_back({"", each_ms(run.additions, &PcmAddition::search_s), colour, true});
    time.curves.push_back(
        {name, running_median_ms(run.additions, &PcmAddition::search_s), colour, false});
    size.curves.push_back({name, sizes(run.additions), colour, false});
  }
  if (runs.empty()) return plot_curves(std::vector{time, size});
  const Additions first(runs.front().additions);
  const std::size_t colour = runs.size();
  if (total(first, &PcmAddition::check_s) > 0.0)
    time.curves.push_back(
        {"consistency checks", running_median_ms(first, &PcmAddition::check_s), colour, false});
  if (auto all_true = true_vertices(first); !all_true.empty())
    size.curves.push_back({"true closures added", std::move(all_true), colour, false});
  return plot_curves(std::vector{time, size});
}

}  // namespace km
