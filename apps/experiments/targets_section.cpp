#include "apps/experiments/report_sections.hpp"

namespace km {

ReportSection targets_section(const ReportInput& input) {
  ReportSection section{.id = "targets", .title = "Numbers to reach", .blocks = {}};
  if (input.targets.empty()) {
    section.blocks.emplace_back(ReportParagraph{"Nothing was measured yet."});
    return section;
  }
  ReportTable table{.caption = "What was asked for, and what was measured",
                    .columns = {"", "where", "wanted", "measured", ""}};
  std::size_t met = 0;
  for (const Target& target : input.targets) {
    const auto style = target.met ? ReportCell::Style::kMet : ReportCell::Style::kMissed;
    table.rows.push_back({{target.what},
                          {target.where},
                          {target.wanted},
                          {target.measured},
                          {.text = target.met ? "met" : "missed", .style = style}});
    met += target.met ? 1 : 0;
  }
  table.note = std::to_string(met) + " of " + std::to_string(input.targets.size()) + " are met.";
  section.blocks.emplace_back(std::move(table));
  return section;
}

}  // namespace km
