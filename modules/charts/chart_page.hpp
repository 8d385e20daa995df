#pragma once

#include <map>
#include <string>
#include <vector>

#include "modules/charts/plot.hpp"

namespace km {

/// A document for a browser with the plots below each other, drawn by charts.js: values under the
/// pointer, series that can be hidden, maps that can be moved, and each to be saved as SVG. It
/// needs no other file and no network; text of the plots is shown as text.
[[nodiscard]] std::string chart_page(const std::string& title, const std::vector<Plot>& plots);

/// The same within another page: script elements that show plots in its elements of these ids.
[[nodiscard]] std::string plot_scripts(const std::map<std::string, std::vector<Plot>>& plots);

}  // namespace km
