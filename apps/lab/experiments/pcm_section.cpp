#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/lab/experiments/report.hpp"
#include "modules/core/json.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {
namespace {

constexpr std::size_t kWindow = 50;  // additions whose median time is shown
constexpr double kLeastShare_percent = 98.0;

// One search on the closures of one seed, addition by addition.
struct SearchRun {
  std::vector<double> search_s, clique;

  double sum_s() const {
    double sum = 0.0;
    for (const double s : search_s) sum += s;
    return sum;
  }
  // Median over the last kWindow additions before the graph has `vertices` vertices.
  double recent_ms(std::size_t vertices) const {
    const std::size_t begin = vertices > kWindow ? vertices - kWindow : 0;
    return 1e3 * statistics_of({search_s.begin() + static_cast<std::ptrdiff_t>(begin),
                                search_s.begin() + static_cast<std::ptrdiff_t>(vertices)})
                     .median;
  }
};

// One search, with a run per seed.
struct Search {
  std::string name;
  std::vector<SearchRun> runs;
};

void add_runs(const std::filesystem::path& file, std::vector<Search>& searches) {
  const Json root = read_json(file);
  const auto add = [&](const Json& node) {
    const std::string name = node.value("search", "?");
    SearchRun run;
    for (const Json& addition : node.value("additions", Json::array())) {
      run.search_s.push_back(number_at(addition, "/search_s").value_or(0.0));
      run.clique.push_back(number_at(addition, "/clique").value_or(0.0));
    }
    if (run.clique.empty()) return;
    auto search = std::find_if(searches.begin(), searches.end(),
                               [&](const Search& other) { return other.name == name; });
    if (search == searches.end()) search = searches.insert(search, Search{name, {}});
    search->runs.push_back(std::move(run));
  };
  if (root.is_object()) return add(root);
  for (const Json& run : root) add(run);
}

// Number of vertices that all runs reached.
std::size_t common_size(const std::vector<Search>& searches) {
  std::size_t size = searches.front().runs.front().clique.size();
  for (const Search& search : searches)
    for (const SearchRun& run : search.runs) size = std::min(size, run.clique.size());
  return size;
}

ReportTable table_of(const std::vector<Search>& searches) {
  ReportTable table{.caption = "Fig. 5 as numbers: search time and clique against vertices",
                    .groups = {{"", 1},
                               {"search of one addition [ms]", searches.size()},
                               {"clique", searches.size()}},
                    .columns = {"vertices"}};
  for (int k = 0; k < 2; ++k)
    for (const Search& search : searches) table.columns.push_back(search.name);
  const std::size_t all = common_size(searches);
  std::vector<std::size_t> sizes;
  for (const std::size_t size : {100UL, 250UL, 500UL, 1000UL, 1500UL})
    if (size < all) sizes.push_back(size);
  sizes.push_back(all);
  for (const std::size_t size : sizes) {
    std::vector<ReportCell> row{{std::to_string(size)}};
    for (const Search& search : searches)
      row.push_back(
          spread_cell(spread_over(search.runs, [&](auto& run) { return run.recent_ms(size); }), 3));
    for (const Search& search : searches)
      row.push_back(spread_cell(
          spread_over(search.runs, [&](auto& run) { return run.clique[size - 1]; }), 0));
    table.rows.push_back(std::move(row));
  }
  std::vector<ReportCell> row{{"all additions, in sum"}};
  for (const Search& search : searches)
    row.push_back(
        spread_cell(spread_over(search.runs, [](auto& run) { return 1e3 * run.sum_s(); }), 1));
  row.resize(table.columns.size());
  table.rows.push_back(std::move(row));
  table.note = "Times: processor time of one thread, median of the last " +
               std::to_string(kWindow) + " additions. Of " +
               std::to_string(searches.front().runs.size()) +
               " seeds of the false closures the median, and the lowest and highest.";
  return table;
}

// Lines are medians over the seeds, faint points the lowest and highest.
void add_curves(const Search& search, std::size_t colour, std::size_t all, const auto& value,
                Plot& plot) {
  constexpr std::size_t kPoints = 150;
  PlotSeries median{search.name, {}, colour},
      range{search.name, {}, colour, PlotSeries::Style::kDots};
  const std::size_t step = std::max<std::size_t>(1, all / kPoints);
  for (std::size_t size = step; size <= all; size += step) {
    const Spread spread = spread_over(search.runs, [&](auto& run) { return value(run, size); });
    const auto x = static_cast<double>(size);
    median.points.push_back({x, spread.median});
    if (spread.count > 1)
      range.points.insert(range.points.end(), {{x, spread.lowest}, {x, spread.highest}});
  }
  plot.series.push_back(std::move(range));
  plot.series.push_back(std::move(median));
}

ReportFigure figure_of(const std::vector<Search>& searches) {
  Plot time{.title = "CPU time of one addition, median of the last 50",
            .x_label = "vertices",
            .y_label = "ms",
            .log_y = true};
  Plot size{.title = "Size of the clique", .x_label = "vertices", .y_label = "closures"};
  const std::size_t all = common_size(searches);
  for (std::size_t k = 0; k < searches.size(); ++k) {
    add_curves(
        searches[k], k, all, [](auto& run, std::size_t n) { return run.recent_ms(n); }, time);
    add_curves(
        searches[k], k, all, [](auto& run, std::size_t n) { return run.clique[n - 1]; }, size);
  }
  return {.name = "pcm",
          .caption =
              "Time of a search and size of the clique against vertices: medians over the "
              "seeds; faint points: the lowest and highest.",
          .plots = {time, size}};
}

void add_targets(const std::vector<Search>& searches, ReportInput& input) {
  const auto find = [&](const char* name) {
    return std::find_if(searches.begin(), searches.end(),
                        [&](const auto& search) { return search.name == name; });
  };
  const auto batch = find("batch");
  if (batch == searches.end()) return;
  for (const char* name : {"incremental", "exact"}) {
    const auto search = find(name);
    if (search == searches.end()) continue;
    std::vector<double> faster, share_percent;
    for (std::size_t k = 0; k < std::min(search->runs.size(), batch->runs.size()); ++k) {
      faster.push_back(batch->runs[k].sum_s() / std::max(1e-9, search->runs[k].sum_s()));
      share_percent.push_back(100.0 * search->runs[k].clique.back() /
                              std::max(1.0, batch->runs[k].clique.back()));
    }
    const std::string where =
        "pose graph with outliers, " + std::to_string(faster.size()) + " seeds, the worst";
    const double least = *std::min_element(faster.begin(), faster.end());
    input.add_target({std::string(name) + " search against batch, all additions", where, "faster",
                      fixed(least, least < 10.0 ? 1 : 0) + " times as fast", least > 1.0});
    const double share = *std::min_element(share_percent.begin(), share_percent.end());
    input.add_target({std::string(name) + " search: clique against batch", where,
                      "comparable (at least 98 %)", fixed(share, 1) + " %",
                      share >= kLeastShare_percent});
  }
}

}  // namespace

std::optional<ReportSection> pcm_section(ReportInput& input) {
  std::vector<Search> searches;
  for (const unsigned seed : input.config().pcm.seeds)
    if (input.has("pcm-" + std::to_string(seed)))
      add_runs(pcm_files(seed, input.paths()).json, searches);
  if (searches.empty()) return std::nullopt;
  ReportSection section{.id = "pcm", .title = "Outlier rejection"};
  section.add(ReportParagraph{
      "Closures of the Manhattan graph and random false ones enter the consistency graph one at a "
      "time; after each the clique of closures that agree is searched again from scratch (batch), "
      "improved from "
      "the new vertex only (incremental, as in the paper), or found exactly (exact, ours). The "
      "paper shows two plots without numbers: incremental is much faster, and its cliques are of "
      "comparable size."});
  section.add(table_of(searches));
  section.add(ReportFigures{{figure_of(searches)}});
  add_targets(searches, input);
  return section;
}

}  // namespace km
