#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "apps/lab/pgo/outlier_study.hpp"
#include "modules/charts/chart_page.hpp"

namespace km {

/// Text with one row per share and method: median and worst of all seeds.
[[nodiscard]] std::string outlier_text(const OutlierStudy& study);

/// Every run. "ratio" is the RMS error divided by that of the reference with the same share and
/// seed; null without a reference.
void write_outlier_json(std::ostream& out, const OutlierStudy& study);

/// Error, closures lost and kept, and CPU time against the share of false closures: the worst seed
/// of each method, and the median CPU time.
[[nodiscard]] std::vector<Plot> outlier_plots(const OutlierStudy& study);

}  // namespace km
