#include <catch2/catch.hpp>

#include "apps/experiments/bar_chart.hpp"

namespace km {
namespace {

using Catch::Contains;

TEST_CASE("A bar is as high as its value", "[experiments]") {
  const std::string svg =
      draw_bars({.title = "a < b",
                 .y_label = "error",
                 .groups = {"one", "two"},
                 .series = {{"before", {4.0, std::nullopt}}, {"after", {2.0, 1.0}}},
                 .decimals = 1});
  // The axis ends at 4 and is 190 high.
  CHECK_THAT(svg, Contains("height=\"190.0\" rx") && Contains("height=\"95.0\" rx") &&
                      Contains("height=\"47.5\" rx") && Contains("a &lt; b") && Contains(">4.0<"));
}

TEST_CASE("A chart without values is drawn empty", "[experiments]") {
  CHECK_THAT(draw_bars({.title = "none", .y_label = "", .groups = {}, .series = {}}),
             Catch::StartsWith("<svg") && Catch::EndsWith("</svg>\n"));
}

}  // namespace
}  // namespace km
