#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "modules/core/io/json.hpp"

namespace km {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
};

/// Points of one line.
struct PlotSeries {
  static constexpr std::size_t kGrey = static_cast<std::size_t>(-1);

  /// Series with equal names have one entry in the legend and are hidden together.
  std::string name = {};
  std::vector<PlotPoint> points = {};
  std::size_t colour = 0;  ///< Number of the colour, as for robots, or kGrey.
  double width_px = 1.6;
};

/// Positions from above [m], with one scale for both axes. Points that are not finite are not drawn
/// and interrupt a line.
struct Plot {
  std::string title = {};
  std::vector<PlotSeries> series = {};
};

/// {title, series: [{name, colour (null: grey), width, points: [[x, y]...]}]}, as chart_page.js
/// reads it. Numbers have six digits; null stands for a number that is not finite. A point nearer
/// to the one before than a 4000th of the range of all points is dropped.
void to_json(Json& json, const Plot& plot);

/// A document for a browser with the plot, drawn by charts.js. It shows values under the pointer.
/// Series can be hidden, the map can be moved and saved as SVG. It needs no other file and no
/// network. Text of the plot is shown as text.
[[nodiscard]] std::string chart_page(const std::string& title, const Plot& plot);

}  // namespace km
