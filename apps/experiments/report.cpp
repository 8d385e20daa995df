#include "apps/experiments/report.hpp"

#include <array>

#include "apps/experiments/report_sections.hpp"
#include "apps/output_file.hpp"
#include "modules/core/json_writer.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLead =
    "Every table and figure of the evaluation of “Kimera-Multi: a System for Distributed "
    "Multi-Robot Metric-Semantic SLAM” (Chang, Tian, How, Carlone, ICRA 2021), made by this "
    "program. Our value stands first, the paper's in grey below it (in brackets in the Markdown). "
    "Worlds are like the paper's in kind, not the same: compare ratios before values.";

constexpr const char* kQuick =
    " These are the small versions (--quick), to see that all works: their numbers say little "
    "about "
    "the paper's.";

ReportDocument make_document(ReportInput& input) {
  ReportDocument document{
      .title = "Kimera-Multi: the paper's experiments", .lead = kLead, .sections = {}};
  if (input.config().quick) document.lead += kQuick;
  std::string missing;
  std::vector<ReportSection> sections;
  constexpr std::array kSections = {pcm_section, trajectory_section, resources_section,
                                    mesh_section, semantics_section};
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

// Pictures beside the Markdown.
void write_figures(const ReportDocument& document, const fs::path& folder) {
  fs::create_directories(folder);
  for (const ReportSection& section : document.sections)
    for (const ReportBlock& block : section.blocks) {
      const auto* const row = std::get_if<ReportFigures>(&block);
      if (row == nullptr) continue;
      for (const ReportFigure& figure : row->figures)
        if (!figure.svg.empty())
          write_output(folder / (figure.name + ".svg"),
                       [&](std::ostream& out) { out << figure.svg; });
    }
}

void write_table(JsonWriter& json, const ReportTable& table) {
  json.begin_object();
  json.field("caption", table.caption);
  json.array("columns", table.columns);
  json.key("rows");
  json.begin_array();
  for (const auto& row : table.rows) {
    json.begin_array();
    for (const ReportCell& cell : row) {
      json.begin_object();
      json.field("value", cell.text);
      if (!cell.paper.empty()) json.field("paper", cell.paper);
      json.end_object();
    }
    json.end_array();
  }
  json.end_array();
  json.end_object();
}

void write_numbers(std::ostream& out, const ReportDocument& document) {
  JsonWriter json(out);
  json.begin_object();
  for (const ReportSection& section : document.sections) {
    json.key(section.id);
    json.begin_array();
    for (const ReportBlock& block : section.blocks)
      if (const auto* const table = std::get_if<ReportTable>(&block)) write_table(json, *table);
    json.end_array();
  }
  json.end_object();
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
  write_figures(document, paths.results / "figures");
  write_output(summary.html, [&](std::ostream& out) { out << to_html(document); });
  write_output(summary.markdown, [&](std::ostream& out) { out << to_markdown(document); });
  write_output(paths.results / "numbers.json",
               [&](std::ostream& out) { write_numbers(out, document); });
  return summary;
}

}  // namespace km
