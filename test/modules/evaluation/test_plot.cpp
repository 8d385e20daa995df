#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <string>

#include "modules/evaluation/plot.hpp"

namespace km {
namespace {

using Catch::Contains;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++found;
  return found;
}

Plot panel(std::vector<PlotPoint> points, bool log_y) {
  return {.title = "a < b",
          .x_label = "x",
          .y_label = "y",
          .log_y = log_y,
          .series = {{.name = "one & only", .points = std::move(points)}}};
}

TEST_CASE("A plot has round ticks, escaped names and its corners where they belong", "[plot]") {
  const std::string svg = draw_plots(std::vector{panel({{0, 0}, {10, 4}}, false)});
  CHECK_THAT(svg, Catch::StartsWith("<svg") && Catch::EndsWith("</svg>\n"));
  CHECK_THAT(svg, Contains("a &lt; b") && Contains("one &amp; only"));
  for (const char* tick : {">2<", ">4<", ">6<", ">8<", ">10<"}) CHECK_THAT(svg, Contains(tick));
  // From the lower left corner of the axes to the upper right one.
  CHECK_THAT(svg, Contains("M70.0,294.0 L630.0,34.0"));
}

TEST_CASE("A logarithmic axis has decades and leaves out what has no logarithm", "[plot]") {
  const std::string svg =
      draw_plots(std::vector{panel({{1, 0.02}, {2, 0.0}, {3, -1.0}, {4, 50.0}}, true)});
  for (const char* tick : {">0.01<", ">0.1<", ">1<", ">10<", ">100<"})
    CHECK_THAT(svg, Contains(tick));
  CHECK(count(svg, "L") == 1);  // two points, one line
}

TEST_CASE("Marks show every point, also a single one", "[plot]") {
  Plot one = panel({{10, 4}}, false);
  CHECK(count(draw_plots(std::vector{one}), "<circle") == 0);
  one.series[0].style = PlotSeries::Style::kMarkedLine;
  CHECK_THAT(draw_plots(std::vector{one}), Contains("cx=\"630.0\" cy=\"34.0\""));
  Plot three = panel({{1, 0.02}, {2, 0.0}, {4, 50.0}}, true);
  three.series[0].style = PlotSeries::Style::kMarkedLine;
  CHECK(count(draw_plots(std::vector{three}), "<circle") == 2);  // 0 has no logarithm
}

TEST_CASE("Panels without a finite point, or without any, are drawn empty", "[plot]") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const bool log_y = GENERATE(false, true);
  const std::string svg =
      draw_plots(std::vector{panel({}, log_y), panel({{kNan, 1}, {1, INFINITY}}, log_y)});
  CHECK(count(svg, "a &lt; b") == 2);
  CHECK_THAT(svg, !Contains("nan") && !Contains("inf"));
}

TEST_CASE("A constant curve has an axis that contains it", "[plot]") {
  const double value = GENERATE(0.0, 7.0, -3.0, 1e9);
  const std::string svg = draw_plots(std::vector{panel({{1, value}, {2, value}}, false)});
  CHECK_THAT(svg, !Contains("nan") && !Contains("inf"));
  CHECK(svg.size() < 5000);  // not a tick per unit
}

TEST_CASE("A bar is as high as its value", "[plot]") {
  constexpr auto kBars = PlotSeries::Style::kBars;
  const Plot chart{
      .groups = {"one", "two"},
      .series = {{"before", {{0, 4.0}}, 0, kBars}, {"after", {{0, 2}, {1, 1}}, 1, kBars}}};
  const std::string svg = draw_plots({&chart, 1});
  // The axis ends at 4 and is 260 high.
  CHECK_THAT(svg, Contains("height=\"260.0\" fill=\"#1f77b4\"") &&
                      Contains("height=\"130.0\" fill=\"#ff7f0e\"") &&
                      Contains("height=\"65.0\" fill") && Contains(">4.0<") && Contains(">two<"));
}

TEST_CASE("A map has one scale for both axes", "[plot]") {
  const Plot map{.is_map = true, .series = {{.name = "", .points = {{100, 10}, {110, 12}}}}};
  // 560 px are 10.6 with the margins: from 100 to 110 in x are 528.3 px, 2 in y are 105.7.
  CHECK_THAT(draw_plots({&map, 1}), Contains("M85.8,155.5 L614.2,49.8"));
}

TEST_CASE("Zero is a zero on axes with negative ends", "[plot]") {
  const Plot map{.is_map = true, .series = {{.name = "", .points = {{-0.1, -3.1}, {3.0, 1.0}}}}};
  const std::string svg = draw_plots({&map, 1});
  CHECK_THAT(svg, Contains(">0<") && Contains(">-1<"));
  CHECK_THAT(svg, !Contains(">-0<") && !Contains("e-1"));
}

}  // namespace
}  // namespace km
