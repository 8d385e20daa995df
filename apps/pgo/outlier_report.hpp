#pragma once

#include <iosfwd>
#include <string>

#include "apps/pgo/outlier_study.hpp"

namespace km {

/// A row per share and method. Of several seeds: the fewest true and the most false closures kept,
/// and medians of the rest.
[[nodiscard]] std::string outlier_text(const OutlierStudy& study);

/// {"poses", "robots", "true_closures", "certified", "half_side_m", "results": [{"method",
/// "share_percent", "seed", "false_closures", "true_kept", "false_kept", "noise_scale", "rmse_m",
/// "rounds", "decided", "bytes", "cpu_s"}]}
void write_outlier_json(std::ostream& out, const OutlierStudy& study);

/// SVG: error, closures kept, and CPU time against the share of false closures.
[[nodiscard]] std::string outlier_plot(const OutlierStudy& study);

}  // namespace km
