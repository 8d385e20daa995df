#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "apps/experiments/report_document.hpp"

namespace km {

/// Values of the same quantity in several runs.
struct Spread {
  std::size_t count = 0;
  double median = 0.0;  ///< Mean of the middle two for an even count.
  double lowest = 0.0, highest = 0.0;
};

/// Values that are not finite are left out; all zero without any.
[[nodiscard]] Spread spread_of(std::vector<double> values);

/// The median; where there are several values, with "lowest to highest" in grey below it (in
/// brackets in the Markdown). "-" without values.
[[nodiscard]] ReportCell spread_cell(const Spread& spread, int decimals);

/// " (30 to 39 in 3 runs)", to stand behind the median; empty for a single value.
[[nodiscard]] std::string range_text(const Spread& spread, int decimals);

}  // namespace km
