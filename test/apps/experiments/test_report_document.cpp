#include <catch2/catch.hpp>

#include "apps/experiments/report_document.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

ReportDocument document_with(ReportBlock block) {
  ReportDocument document{.title = "T", .lead = "L", .sections = {}};
  document.sections.push_back({.id = "s", .title = "S", .blocks = {}});
  document.sections[0].blocks.push_back(std::move(block));
  return document;
}

TEST_CASE("A table has groups, our values and the paper's", "[experiments]") {
  const ReportDocument document = document_with(ReportTable{
      .caption = "C",
      .groups = {{"", 1}, {"g", 2}},
      .columns = {"world", "x", "y"},
      .rows = {{{"a|b"}, {"1", "2"}, {.text = "3", .style = ReportCell::Style::kBest}}}});
  CHECK_THAT(to_html(document), Contains("<th class=\"group\" colspan=\"2\">g</th>") &&
                                    Contains("<td>1<span class=\"paper\">2</span></td>") &&
                                    Contains("<td class=\"best\">3</td>"));
  CHECK_THAT(to_markdown(document), Contains("| world | g: x | g: y |\n| --- | ---: | ---: |\n"
                                             "| a\\|b | 1 (2) | **3** |"));
}

TEST_CASE("Pictures are in the page itself", "[experiments]") {
  const TemporaryFolder folder;
  const auto png = folder.write("p.png", "\x89PNG");
  const std::string page = to_html(
      document_with(ReportFigures{{{.name = "a",
                                    .caption = "drawn",
                                    .svg = "<svg xmlns=\"x\" width=\"30\" height=\"20\"></svg>"},
                                   {.name = "b", .caption = "taken", .png = png}}}));
  CHECK_THAT(page, Contains("<svg viewBox=\"0 0 30 20\"") &&
                       Contains("src=\"data:image/png;base64,iVBORw==\""));
  CHECK_THROWS_WITH(
      to_html(document_with(ReportFigures{{{.name = "c", .caption = "", .png = "no.png"}}})),
      Contains("no.png"));
}

TEST_CASE("Text is escaped", "[experiments]") {
  CHECK_THAT(to_html(document_with(ReportParagraph{"a < b & c"})), Contains("a &lt; b &amp; c"));
}

}  // namespace
}  // namespace km
