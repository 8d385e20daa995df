#pragma once

#include <iosfwd>
#include <string>

#include "apps/lab/pgo/outlier_study.hpp"

namespace km {

/// Text with one row per share and method: median and worst of all seeds.
[[nodiscard]] std::string outlier_text(const OutlierStudy& study);

/// Every run. "ratio" is the RMS error divided by that of the reference with the same share and
/// seed; null without a reference.
void write_outlier_json(std::ostream& out, const OutlierStudy& study);

}  // namespace km
