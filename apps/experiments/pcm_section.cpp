#include <algorithm>
#include <fstream>
#include <iterator>

#include "apps/experiments/json_numbers.hpp"
#include "apps/experiments/report_sections.hpp"
#include "apps/team/text_table.hpp"

namespace km {
namespace {

constexpr std::size_t kWindow = 50;  // additions whose median time is shown

struct SearchRun {
  std::string name;
  std::vector<double> search_s, clique;
};

SearchRun read_run(const YAML::Node& run) {
  SearchRun result;
  result.name = run["search"].as<std::string>("?");
  for (const YAML::Node& addition : run["additions"]) {
    result.search_s.push_back(number_at(addition, "search_s").value_or(0.0));
    result.clique.push_back(number_at(addition, "clique").value_or(0.0));
  }
  return result;
}

std::vector<SearchRun> read_runs(const std::filesystem::path& file) {
  const YAML::Node root = read_json(file);
  std::vector<SearchRun> runs;
  if (root.IsMap()) return {read_run(root)};
  for (const YAML::Node& run : root) runs.push_back(read_run(run));
  return runs;
}

double recent_median_ms(const SearchRun& run, std::size_t vertices) {
  const std::size_t begin = vertices > kWindow ? vertices - kWindow : 0;
  std::vector<double> recent(run.search_s.begin() + static_cast<std::ptrdiff_t>(begin),
                             run.search_s.begin() + static_cast<std::ptrdiff_t>(vertices));
  const auto middle = recent.begin() + static_cast<std::ptrdiff_t>(recent.size() / 2);
  std::nth_element(recent.begin(), middle, recent.end());
  return 1e3 * *middle;
}

double sum_s(const SearchRun& run) {
  double sum = 0.0;
  for (const double s : run.search_s) sum += s;
  return sum;
}

ReportTable table_of(const std::vector<SearchRun>& runs, unsigned seed) {
  ReportTable table{
      .caption = "Fig. 5 as numbers: search time and clique against vertices, seed " +
                 std::to_string(seed),
      .groups = {{"", 1}, {"search of one addition [ms]", runs.size()}, {"clique", runs.size()}},
      .columns = {"vertices"}};
  for (int k = 0; k < 2; ++k)
    for (const SearchRun& run : runs) table.columns.push_back(run.name);
  const std::size_t all = runs.front().clique.size();
  std::vector<std::size_t> sizes;
  for (const std::size_t size : {100UL, 250UL, 500UL, 1000UL, 1500UL})
    if (size < all) sizes.push_back(size);
  sizes.push_back(all);
  for (const std::size_t size : sizes) {
    std::vector<ReportCell> row{{std::to_string(size)}};
    for (const SearchRun& run : runs) row.push_back({fixed(recent_median_ms(run, size), 3)});
    for (const SearchRun& run : runs) row.push_back({fixed(run.clique[size - 1], 0)});
    table.rows.push_back(std::move(row));
  }
  std::vector<ReportCell> row{{"all, in sum [s]"}};
  for (const SearchRun& run : runs) row.push_back({fixed(sum_s(run), 3)});
  row.resize(table.columns.size());
  table.rows.push_back(std::move(row));
  table.note = "Times: processor time of one thread, median of the last " +
               std::to_string(kWindow) + " additions.";
  return table;
}

void add_targets(const std::vector<SearchRun>& runs, unsigned seed, ReportInput& input) {
  const auto find = [&](const char* name) {
    return std::find_if(runs.begin(), runs.end(),
                        [&](const auto& run) { return run.name == name; });
  };
  const auto batch = find("batch"), incremental = find("incremental"), exact = find("exact");
  const std::string where = "pose graph with outliers, seed " + std::to_string(seed);
  const auto compare = [&](auto run, const char* what) {
    if (run == runs.end() || batch == runs.end() || run->clique.empty()) return;
    const double faster = sum_s(*batch) / std::max(1e-9, sum_s(*run));
    input.targets.push_back({std::string(what) + " search against batch, all additions", where,
                             "faster", fixed(faster, 0) + " times as fast", faster > 1.0});
    const double share = 100.0 * run->clique.back() / std::max(1.0, batch->clique.back());
    input.targets.push_back({std::string(what) + " search: clique against batch", where,
                             "comparable (at least 98 %)", fixed(share, 1) + " %", share >= 98.0});
  };
  compare(incremental, "incremental");
  compare(exact, "exact");
}

}  // namespace

ReportSection pcm_section(ReportInput& input) {
  ReportSection section{.id = "pcm", .title = "Outlier rejection", .blocks = {}};
  section.blocks.emplace_back(ReportParagraph{
      "Closures of the Manhattan graph and random false ones enter the consistency graph one at a "
      "time; after each the clique of closures that agree is searched anew (batch), improved from "
      "the new vertex only (incremental, as in the paper), or found exactly (exact, ours). The "
      "paper shows two plots without numbers: incremental is much faster, and its cliques are of "
      "comparable size."});
  for (const unsigned seed : input.config().pcm.seeds) {
    const PcmFiles files = pcm_files(seed, input.paths());
    if (!input.has("pcm-" + std::to_string(seed))) continue;
    const std::vector<SearchRun> runs = read_runs(files.json);
    if (runs.empty() || runs.front().clique.empty()) continue;
    section.blocks.emplace_back(table_of(runs, seed));
    std::ifstream plot(files.plot);
    section.blocks.emplace_back(
        ReportFigures{{{.name = files.plot.stem().string(),
                        .caption = "Time of a search and size of the clique against vertices.",
                        .svg = std::string(std::istreambuf_iterator<char>(plot), {})}}});
    add_targets(runs, seed, input);
  }
  section.blocks.emplace_back(input.provenance("pcm"));
  return section;
}

}  // namespace km
