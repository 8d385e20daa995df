#include "apps/lab/experiments/report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/output_file.hpp"
#include "modules/core/json.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {

Spread spread_of(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return {};
  const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
  return {.count = values.size(),
          .median = statistics_of(values).median,
          .lowest = *lowest,
          .highest = *highest};
}

ReportCell spread_cell(const Spread& spread, int decimals) {
  if (spread.count == 0) return {"-"};
  ReportCell cell{fixed(spread.median, decimals)};
  if (spread.count > 1)
    cell.paper = fixed(spread.lowest, decimals) + " to " + fixed(spread.highest, decimals);
  return cell;
}

std::string range_text(const Spread& spread, int decimals) {
  if (spread.count < 2) return {};
  return " (" + fixed(spread.lowest, decimals) + " to " + fixed(spread.highest, decimals) + " in " +
         std::to_string(spread.count) + " runs)";
}

namespace {

enum class Verdict { kMissed, kMet, kNotJudged };

Verdict verdict_of(const Target& target) {
  if (!target.judged) return Verdict::kNotJudged;
  return target.met ? Verdict::kMet : Verdict::kMissed;
}

ReportTable table_of(const std::vector<Target>& targets, Verdict verdict) {
  using Style = ReportCell::Style;
  const Style style = verdict == Verdict::kMet      ? Style::kMet
                      : verdict == Verdict::kMissed ? Style::kMissed
                                                    : Style::kPlain;
  ReportTable table{.caption = verdict == Verdict::kMet ? "Met"
                               : verdict == Verdict::kMissed
                                   ? "Missed"
                                   : "Not judged: inputs of full size answer these",
                    .columns = {"what", "where", "wanted", "measured"},
                    .words = true};
  for (const Target& target : targets)
    if (verdict_of(target) == verdict)
      table.rows.push_back({{target.what},
                            {target.where},
                            {target.wanted},
                            {.text = target.measured, .style = style}});
  return table;
}

}  // namespace

ReportSection targets_section(const ReportInput& input) {
  ReportSection section{.id = "targets", .title = "Numbers to reach"};
  if (input.targets().empty()) {
    section.add(ReportParagraph{"Nothing was measured yet."});
    return section;
  }
  std::size_t met = 0, judged = 0;
  for (const Target& target : input.targets()) {
    judged += target.judged ? 1 : 0;
    met += target.judged && target.met ? 1 : 0;
  }
  section.add(ReportParagraph{std::to_string(met) + " of " + std::to_string(judged) + " are met" +
                              (met < judged ? "; those that are not come first." : ".")});
  for (const Verdict verdict : {Verdict::kMissed, Verdict::kMet, Verdict::kNotJudged})
    section.add(table_of(input.targets(), verdict));
  return section;
}

namespace {

namespace fs = std::filesystem;

constexpr const char* kLead =
    "Every table and figure of the evaluation of “Kimera-Multi: a System for Distributed "
    "Multi-Robot Metric-Semantic SLAM” (Chang, Tian, How, Carlone, ICRA 2021), made by this "
    "program. Our value stands first, the paper's in grey below it (in brackets in the Markdown). "
    "Worlds are like the paper's in kind, not the same: compare ratios before values.";

constexpr const char* kQuick =
    " These are the small versions (--quick), to see that all works: their numbers mean little "
    "about "
    "the paper's.";

ReportDocument make_document(ReportInput& input) {
  ReportDocument document{
      .title = "Kimera-Multi: the paper's experiments", .lead = kLead, .sections = {}};
  if (input.config().quick) document.lead += kQuick;
  std::string missing;
  std::vector<ReportSection> sections;
  constexpr std::array kSections = {pcm_section,       cosmo_section, trajectory_section,
                                    resources_section, mesh_section,  semantics_section,
                                    levels_section};
  static_assert(kSections.size() == kExperiments.size());
  for (std::size_t k = 0; k < kSections.size(); ++k)
    if (auto section = kSections[k](input))
      sections.push_back(std::move(*section));
    else
      missing +=
          (missing.empty() ? " No results so far: " : ", ") + std::string(kExperiments[k].name);
  if (!missing.empty()) document.lead += missing + '.';
  document.sections.push_back(targets_section(input));
  for (ReportSection& section : sections) document.sections.push_back(std::move(section));
  document.sections.push_back(
      {.id = "origin", .title = "How the numbers were obtained", .blocks = {input.provenance()}});
  return document;
}

Json to_json(const ReportTable& table) {
  Json rows = Json::array();
  for (const auto& row : table.rows) {
    Json& cells = rows.emplace_back(Json::array());
    for (const ReportCell& cell : row) {
      cells.push_back({{"value", cell.text}});
      if (!cell.paper.empty()) cells.back()["paper"] = cell.paper;
    }
  }
  return {{"caption", table.caption}, {"columns", table.columns}, {"rows", std::move(rows)}};
}

Json numbers_of(const ReportDocument& document) {
  Json json = Json::object();
  for (const ReportSection& section : document.sections) {
    Json& tables = json[section.id] = Json::array();
    for (const ReportBlock& block : section.blocks)
      if (const auto* const table = std::get_if<ReportTable>(&block))
        tables.push_back(to_json(*table));
  }
  return json;
}

}  // namespace

ReportSummary write_report(const ExperimentConfig& config, const ExperimentPaths& paths) {
  ReportInput input(config, paths);
  const ReportDocument document = make_document(input);
  ReportSummary summary{.html = paths.results / "report.html",
                        .markdown = paths.results / "report.md"};
  for (const Target& target : input.targets()) {
    summary.targets += target.judged ? 1 : 0;
    summary.met += target.judged && target.met ? 1 : 0;
  }
  write_output(summary.html, [&](std::ostream& out) { out << to_html(document); });
  write_output(summary.markdown, [&](std::ostream& out) { out << to_markdown(document); });
  write_output(paths.results / "numbers.json",
               [&](std::ostream& out) { out << json_text(numbers_of(document)); });
  return summary;
}

}  // namespace km
