#pragma once

#include <optional>
#include <string>
#include <vector>

namespace km {

/// Bars of one colour, one in each group.
struct BarSeries {
  std::string name;
  std::vector<std::optional<double>> values;  ///< One per group; not negative.
};

/// Bars side by side in groups, over an axis from 0.
struct BarChart {
  std::string title;
  std::string y_label;
  std::vector<std::string> groups;
  std::vector<BarSeries> series;
  int decimals = 1;  ///< Of the numbers on the bars.
};

/// An SVG document.
[[nodiscard]] std::string draw_bars(const BarChart& chart);

}  // namespace km
