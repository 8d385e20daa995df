#include "apps/experiments/report_sections.hpp"

namespace km {

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
  ReportSection section{.id = "targets", .title = "Numbers to reach", .blocks = {}};
  if (input.targets().empty()) {
    section.blocks.emplace_back(ReportParagraph{"Nothing was measured yet."});
    return section;
  }
  std::size_t met = 0, judged = 0;
  for (const Target& target : input.targets()) {
    judged += target.judged ? 1 : 0;
    met += target.judged && target.met ? 1 : 0;
  }
  section.blocks.emplace_back(
      ReportParagraph{std::to_string(met) + " of " + std::to_string(judged) + " are met" +
                      (met < judged ? "; those that are not come first." : ".")});
  for (const Verdict verdict : {Verdict::kMissed, Verdict::kMet, Verdict::kNotJudged})
    if (ReportTable table = table_of(input.targets(), verdict); !table.rows.empty())
      section.blocks.emplace_back(std::move(table));
  return section;
}

}  // namespace km
