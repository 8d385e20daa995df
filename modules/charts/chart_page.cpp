#include "modules/charts/chart_page.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "modules/charts/html_page.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/core/io/xml_text.hpp"

namespace km {
namespace {

constexpr double kMapSteps = 4000.0;  // more steps over a range than any screen shows
constexpr int kDigits = 6;

bool is_finite(const PlotPoint& point) {
  return std::isfinite(point.x) && std::isfinite(point.y);
}

// The longer side of the bounding box of all points.
double range_of(const std::vector<PlotSeries>& all) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  PlotPoint low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
  for (const PlotSeries& series : all)
    for (const PlotPoint& point : series.points) {
      if (!is_finite(point)) continue;
      low = {std::min(low.x, point.x), std::min(low.y, point.y)};
      high = {std::max(high.x, point.x), std::max(high.y, point.y)};
    }
  return std::max({0.0, high.x - low.x, high.y - low.y});
}

std::vector<PlotPoint> thinned(const std::vector<PlotPoint>& points, double step) {
  std::vector<PlotPoint> kept;
  for (const PlotPoint& point : points)
    if (kept.empty() || !is_finite(point) || !is_finite(kept.back()) ||
        std::hypot(point.x - kept.back().x, point.y - kept.back().y) >= step)
      kept.push_back(point);
  return kept;
}

Json number(double value) {
  return std::isfinite(value) ? Json(std::stod(rounded(value, kDigits))) : Json();
}

Json series_json(const PlotSeries& series, double step) {
  Json points = Json::array();
  for (const PlotPoint& point : thinned(series.points, step))
    points.push_back({number(point.x), number(point.y)});
  return {{"name", series.name},
          {"colour", series.colour == PlotSeries::kGrey ? Json() : Json(series.colour)},
          {"width", series.width_px},
          {"points", std::move(points)}};
}

}  // namespace

void to_json(Json& json, const Plot& plot) {
  const double step = range_of(plot.series) / kMapSteps;
  Json series = Json::array();
  for (const PlotSeries& one : plot.series) series.push_back(series_json(one, step));
  json = {{"title", plot.title}, {"series", std::move(series)}};
}

std::string chart_page(const std::string& title, const Plot& plot) {
  return html_page(
      {.title = title,
       .styles = {page_file(chart_files(), "theme.css"), page_file(chart_files(), "document.css")},
       .body = "<main id=\"charts\">\n<header><h1>" + xml_escaped(title) +
               "</h1></header>\n</main>\n" + data_script("plot", plot) +
               module_script({page_file(chart_files(), "charts.js"),
                              page_file(chart_files(), "chart_page.js")})});
}

}  // namespace km
