#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

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
    kBars,        ///< From 0 to y, its value above it; x is the number of a group.
  };

  std::string name = {};  ///< Empty: not in the legend.
  std::vector<PlotPoint> points = {};
  std::size_t colour = 0;  ///< Number of it, or kGrey; series of one matter share theirs.
  Style style = Style::kLine;
  double width_px = 1.6;  ///< Of a line.
};

/// Series over common axes.
struct Plot {
  std::string title = {};
  std::string x_label = {};
  std::string y_label = {};
  bool log_y = false;                    ///< Points that are not positive are left out.
  bool is_map = false;                   ///< One scale for both axes, which need not begin at 0.
  std::vector<std::string> groups = {};  ///< Names of x = 0, 1, ...: of bars side by side.
  int decimals = 1;                      ///< Of the values of bars.
  std::vector<PlotSeries> series = {};
};

/// An SVG document: the plots below each other, each with axes at round numbers and a legend.
/// Points that are not finite are left out; a plot without points is drawn empty. It has a size of
/// its own and a view box, so that a page may give it another.
[[nodiscard]] std::string draw_plots(std::span<const Plot> plots);

}  // namespace km
