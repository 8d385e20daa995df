#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <string>

#include "modules/evaluation/curve_plot.hpp"

namespace km {
namespace {

using Catch::Contains;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++found;
  return found;
}

CurvePanel panel(std::vector<CurvePoint> points, bool log_y) {
  return {.title = "a < b",
          .x_label = "x",
          .y_label = "y",
          .log_y = log_y,
          .curves = {{.name = "one & only", .points = std::move(points)}}};
}

TEST_CASE("A plot has round ticks, escaped names and its corners where they belong", "[plot]") {
  const std::string svg = plot_curves(std::vector{panel({{0, 0}, {10, 4}}, false)});
  CHECK_THAT(svg, Catch::StartsWith("<svg") && Catch::EndsWith("</svg>\n"));
  CHECK_THAT(svg, Contains("a &lt; b") && Contains("one &amp; only"));
  for (const char* tick : {">2<", ">4<", ">6<", ">8<", ">10<"}) CHECK_THAT(svg, Contains(tick));
  // From the lower left corner of the axes to the upper right one.
  CHECK_THAT(svg, Contains("M70.0,294.0 L630.0,34.0"));
}

TEST_CASE("A logarithmic axis has decades and leaves out what has no logarithm", "[plot]") {
  const std::string svg =
      plot_curves(std::vector{panel({{1, 0.02}, {2, 0.0}, {3, -1.0}, {4, 50.0}}, true)});
  for (const char* tick : {">0.01<", ">0.1<", ">1<", ">10<", ">100<"})
    CHECK_THAT(svg, Contains(tick));
  CHECK(count(svg, "L") == 1);  // two points, one line
}

TEST_CASE("Marks show every point, also a single one", "[plot]") {
  CurvePanel one = panel({{10, 4}}, false);
  CHECK(count(plot_curves(std::vector{one}), "<circle") == 0);
  one.curves[0].marks = true;
  CHECK_THAT(plot_curves(std::vector{one}), Contains("cx=\"630.0\" cy=\"34.0\""));
  CurvePanel three = panel({{1, 0.02}, {2, 0.0}, {4, 50.0}}, true);
  three.curves[0].marks = true;
  CHECK(count(plot_curves(std::vector{three}), "<circle") == 2);  // 0 has no logarithm
}

TEST_CASE("Panels without a finite point, or without any, are drawn empty", "[plot]") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const bool log_y = GENERATE(false, true);
  const std::string svg =
      plot_curves(std::vector{panel({}, log_y), panel({{kNan, 1}, {1, INFINITY}}, log_y)});
  CHECK(count(svg, "a &lt; b") == 2);
  CHECK_THAT(svg, !Contains("nan") && !Contains("inf"));
}

TEST_CASE("A constant curve has an axis that contains it", "[plot]") {
  const double value = GENERATE(0.0, 7.0, -3.0, 1e9);
  const std::string svg = plot_curves(std::vector{panel({{1, value}, {2, value}}, false)});
  CHECK_THAT(svg, !Contains("nan") && !Contains("inf"));
  CHECK(svg.size() < 5000);  // not a tick per unit
}

}  // namespace
}  // namespace km
