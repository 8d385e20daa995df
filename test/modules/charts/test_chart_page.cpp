#include "modules/charts/chart_page.hpp"

#include <nlohmann/json.hpp>

#include "test/apps/viewer/page_programs.hpp"
#include "test/support/page_text.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Json points_of(const Plot& plot) {
  return Json(plot)["series"][0]["points"];
}

TEST_CASE("A plot is written to JSON with all its properties") {
  const Plot plot{.title = "t",
                  .series = {{.name = "a", .points = {{0, 0.5}, {1, 2}}, .colour = 3},
                             {.name = "b", .colour = PlotSeries::kGrey, .width_px = 3.0}}};
  CHECK(Json(plot) == Json::parse(R"({"title": "t", "series": [
      {"name": "a", "colour": 3, "width": 1.6, "points": [[0.0, 0.5], [1.0, 2.0]]},
      {"name": "b", "colour": null, "width": 3.0, "points": []}]})"));
}

TEST_CASE("Numbers have six digits and a number that is not finite is null") {
  const Plot plot{.series = {{.points = {{1.0 / 3.0, 123456789.0}, {kNan, 1e-7}, {2, INFINITY}}}}};
  CHECK(points_of(plot).dump() == "[[0.333333,123457000.0],[null,1e-07],[2.0,null]]");
}

TEST_CASE("Points too close for a screen are dropped") {
  Plot plot{.series = {{.points = {}}}};
  for (int i = 0; i <= 100000; ++i) plot.series[0].points.push_back({1e-3 * i, 0.0});
  const Json kept = points_of(plot);
  CHECK(kept.size() > 3000);
  CHECK(kept.size() <= 4001);
  for (std::size_t i = 1; i < kept.size(); ++i)
    CHECK(kept[i][0].get<double>() - kept[i - 1][0].get<double>() > 0.024);  // a 4000th of 100 m
}

TEST_CASE("No text of a plot can leave its place in the page") {
  const std::string page = chart_page(
      kHostileText,
      {.title = kHostileText, .series = {{.name = kHostileText}, {.name = "no UTF-8: \xff"}}});
  CHECK(occurrences(page, "<script") == 2);
  CHECK(occurrences(page, "</script") == 2);
  CHECK(occurrences(page, "<!--") == 0);
  CHECK(references_of_page(chart_page("t", {})) == 0);  // needs no other file, no network
  const Json plot = data_of_page(page, "plot");
  CHECK(plot["title"] == kHostileText);
  CHECK(plot["series"][0]["name"] == kHostileText);
}

TEST_CASE("Charts in a browser show the content of their plots") {
  if (const std::string why = missing_page_program(); !why.empty()) {
    std::cout << "SKIPPED: " << why << '\n';
    return;
  }
  const TemporaryFolder folder;
  const auto page = folder.write(
      "charts.html",
      chart_page("Charts", {.title = "map", .series = {{.points = {{100, 10}, {110, 12}}}}}));
  const CommandResult result =
      run_command("node test/modules/charts/charts_in_browser.mjs " + page.string());
  INFO(result.output);
  CHECK(result.exit_code == 0);
}

}  // namespace
}  // namespace km
