#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace km {

struct CurvePoint {
  double x = 0.0;
  double y = 0.0;
};

struct Curve {
  std::string name;  ///< Empty: not in the legend.
  std::vector<CurvePoint> points;
  std::size_t colour = 0;  ///< Number of it; curves of one matter share theirs.
  bool dots = false;       ///< Faint single points in place of a line.
  bool marks = false;      ///< A disc at every point of a line: few points, or only one.
};

/// Curves over common axes.
struct CurvePanel {
  std::string title;
  std::string x_label;
  std::string y_label;
  bool log_y = false;  ///< Points that are not positive are left out.
  std::vector<Curve> curves;
};

/// An SVG document: the panels below each other, each with axes at round numbers and a legend.
/// Points that are not finite are left out; a panel without points is drawn empty.
[[nodiscard]] std::string plot_curves(std::span<const CurvePanel> panels);

}  // namespace km
