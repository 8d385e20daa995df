#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "modules/core/json.hpp"

namespace km {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
};

/// Points that belong together.
struct PlotSeries {
  static constexpr std::size_t kGrey = static_cast<std::size_t>(-1);
  enum class Style {
    kLine,
    kMarkedLine,  ///< With a disc at every point: few points, or only one.
    kDots,        ///< Faint single points.
    kBars,        ///< From 0 to y, its value beside it; x is the number of a group.
  };

  std::string name = {};  ///< Of one name: once in the legend, shown and hidden together.
  std::vector<PlotPoint> points = {};
  std::size_t colour = 0;  ///< Number of it, as of robots, or kGrey.
  Style style = Style::kLine;
  double width_px = 1.6;  ///< Of a line.
};

/// Series over common axes. Points that are not finite are not drawn, and part a line; on a
/// logarithmic axis, those that are not positive likewise.
struct Plot {
  std::string title = {};
  std::string x_label = {};
  std::string y_label = {};
  bool log_y = false;
  bool is_map = false;                   ///< Positions from above [m]: one scale for both axes.
  std::vector<std::string> groups = {};  ///< Names of x = 0, 1, ...: of bars.
  int decimals = 1;                      ///< Of the values of bars.
  std::vector<PlotSeries> series = {};
};

/// {title, x_label, y_label, log_y, map, groups, decimals, series: [{name, colour (null: grey),
/// style: line, marked, dots or bars, width, points: [[x, y]...]}]}, as charts.js reads it. Numbers
/// have six digits, null is one that is not finite. Of a map, points that are nearer to the one
/// before than a 4000th of its range are left out.
void to_json(Json& json, const Plot& plot);

}  // namespace km
