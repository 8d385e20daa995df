#include "modules/charts/chart_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "modules/charts/html_page.hpp"
#include "modules/core/text_table.hpp"
#include "modules/core/xml_text.hpp"

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

// A step of 0 keeps all points.
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
  constexpr std::array kStyles = {"line", "marked", "dots", "bars"};
  Json points = Json::array();
  for (const PlotPoint& point : thinned(series.points, step))
    points.push_back({number(point.x), number(point.y)});
  return {{"name", series.name},
          {"colour", series.colour == PlotSeries::kGrey ? Json() : Json(series.colour)},
          {"style", kStyles.at(static_cast<std::size_t>(series.style))},
          {"width", series.width_px},
          {"points", std::move(points)}};
}

}  // namespace

void to_json(Json& json, const Plot& plot) {
  const double step = plot.is_map ? range_of(plot.series) / kMapSteps : 0.0;
  Json series = Json::array();
  for (const PlotSeries& one : plot.series) series.push_back(series_json(one, step));
  json = {{"title", plot.title},       {"x_label", plot.x_label},    {"y_label", plot.y_label},
          {"log_y", plot.log_y},       {"map", plot.is_map},         {"groups", plot.groups},
          {"decimals", plot.decimals}, {"series", std::move(series)}};
}

std::string plot_scripts(const std::map<std::string, std::vector<Plot>>& plots) {
  return data_script("plots", plots) + module_script({page_file(chart_files(), "charts.js"),
                                                      page_file(chart_files(), "chart_page.js")});
}

std::string chart_page(const std::string& title, const std::vector<Plot>& plots) {
  return html_page(
      {.title = title,
       .styles = {page_file(chart_files(), "theme.css"), page_file(chart_files(), "document.css")},
       .body = "<main id=\"charts\">\n<header><h1>" + xml_escaped(title) +
               "</h1></header>\n</main>\n" + plot_scripts({{"charts", plots}})});
}

}  // namespace km
