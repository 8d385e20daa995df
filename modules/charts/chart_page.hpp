#pragma once

#include <map>
#include <string>
#include <vector>

#include "modules/charts/plot.hpp"

namespace km {

/// A document for a browser with the plots below each other, drawn by charts.js. It shows values
/// under the pointer. Series can be hidden, maps can be moved, and each plot can be saved as SVG.
/// It needs no other file and no network. Text of the plots is shown as text.
[[nodiscard]] std::string chart_page(const std::string& title, const std::vector<Plot>& plots);

/// Script elements for another page. They show each list of plots in the page's element of that id.
[[nodiscard]] std::string plot_scripts(const std::map<std::string, std::vector<Plot>>& plots);

}  // namespace km
