#include "apps/experiments/spread.hpp"

#include <algorithm>
#include <cmath>

#include "apps/team/text_table.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {

Spread spread_of(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return {};
  const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
  return {.count = values.size(),
          .median = statistics_of(values).median,
          .lowest = *lowest,
          .highest = *highest};
}

ReportCell spread_cell(const Spread& spread, int decimals) {
  if (spread.count == 0) return {"-"};
  ReportCell cell{fixed(spread.median, decimals)};
  if (spread.count > 1)
    cell.paper = fixed(spread.lowest, decimals) + " to " + fixed(spread.highest, decimals);
  return cell;
}

std::string range_text(const Spread& spread, int decimals) {
  if (spread.count < 2) return {};
  return " (" + fixed(spread.lowest, decimals) + " to " + fixed(spread.highest, decimals) + " in " +
         std::to_string(spread.count) + " runs)";
}

}  // namespace km
