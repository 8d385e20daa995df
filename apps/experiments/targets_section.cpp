#include "apps/experiments/report_sections.hpp"

namespace km {

namespace {

ReportTable table_of(const std::vector<Target>& targets, bool met) {
  ReportTable table{.caption = met ? "Met" : "Missed",
                    .columns = {"what", "where", "wanted", "measured"},
                    .words = true};
  for (const Target& target : targets)
    if (target.met == met)
      table.rows.push_back({{target.what},
                            {target.where},
                            {target.wanted},
                            {.text = target.measured,
                             .style = met ? ReportCell::Style::kMet : ReportCell::Style::kMissed}});
  return table;
}

}  // namespace

ReportSection targets_section(const ReportInput& input) {
  ReportSection section{.id = "targets", .title = "Numbers to reach", .blocks = {}};
  if (input.targets.empty()) {
    section.blocks.emplace_back(ReportParagraph{"Nothing was measured yet."});
    return section;
  }
  std::size_t met = 0;
  for (const Target& target : input.targets) met += target.met ? 1 : 0;
  section.blocks.emplace_back(ReportParagraph{std::to_string(met) + " of " +
                                              std::to_string(input.targets.size()) +
                                              " are met; those that are not come first."});
  for (const bool wanted : {false, true})
    if (ReportTable table = table_of(input.targets, wanted); !table.rows.empty())
      section.blocks.emplace_back(std::move(table));
  return section;
}

}  // namespace km
