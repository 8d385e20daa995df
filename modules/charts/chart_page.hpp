#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "modules/core/json.hpp"

namespace km {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
};

/// Points of one series.
struct PlotSeries {
  static constexpr std::size_t kGrey = static_cast<std::size_t>(-1);
  enum class Style {
    kLine,
    kMarkedLine,  ///< With a disc at every point, for few points.
    kDots,        ///< Faint separate points.
    kBars,        ///< From 0 to y, with the value beside it; x is the number of a group.
  };

  /// Series with equal names have one entry in the legend and are hidden together.
  std::string name = {};
  std::vector<PlotPoint> points = {};
  std::size_t colour = 0;  ///< Number of the colour, as for robots, or kGrey.
  Style style = Style::kLine;
  double width_px = 1.6;  ///< Width of a line.
};

/// Series over common axes. Points that are not finite are not drawn and interrupt a line. On a
/// logarithmic axis, points that are not positive are not drawn either.
struct Plot {
  std::string title = {};
  std::string x_label = {};
  std::string y_label = {};
  bool log_y = false;
  /// Positions from above [m], with one scale for both axes.
  bool is_map = false;
  std::vector<std::string> groups = {};  ///< Names of the groups x = 0, 1, ... of bars.
  int decimals = 1;                      ///< Decimals of the values of bars.
  std::vector<PlotSeries> series = {};
};

/// {title, x_label, y_label, log_y, map, groups, decimals, series: [{name, colour (null: grey),
/// style: line, marked, dots or bars, width, points: [[x, y]...]}]}, as charts.js reads it. Numbers
/// have six digits; null stands for a number that is not finite. In a map, a point nearer to the
/// one before than a 4000th of the map's range is dropped.
void to_json(Json& json, const Plot& plot);

/// A document for a browser with the plots below each other, drawn by charts.js. It shows values
/// under the pointer. Series can be hidden, maps can be moved, and each plot can be saved as SVG.
/// It needs no other file and no network. Text of the plots is shown as text.
[[nodiscard]] std::string chart_page(const std::string& title, const std::vector<Plot>& plots);

/// Script elements for another page. They show each list of plots in the page's element of that id.
[[nodiscard]] std::string plot_scripts(const std::map<std::string, std::vector<Plot>>& plots);

}  // namespace km
