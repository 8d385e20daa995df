#pragma once

#include <span>
#include <string>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/io/json.hpp"
#include "modules/evaluation/statistics.hpp"

namespace km {

/// A column of a table whose rows are JSON objects.
struct ReportColumn {
  const char* heading;
  const char* place;      ///< JSON pointer of the value in a row, such as "/position_m/rmse".
  int decimals = 0;       ///< Decimals of a number that is not whole.
  double factor = 1.0;    ///< Factor from the value to the number that is shown.
  const char* unit = "";  ///< Text behind the number.
};

/// A column of shares from 0 to 1 in percent.
[[nodiscard]] constexpr ReportColumn percent_column(const char* heading, const char* place) {
  return {heading, place, 1, 100.0, "%"};
}

/// The table for people of an array of JSON objects. Texts and whole numbers appear as they are.
/// Values that are missing, null or not finite are "-".
[[nodiscard]] std::string report_table(const Json& rows, std::span<const ReportColumn> columns);

/// {rmse, mean, median, max, count}. Statistics of an empty sample have count 0 and null for the
/// rest, because zeros would be perfect scores.
void to_json(Json& json, const Statistics& statistics);

/// {translation_m, rotation_xyzw}.
[[nodiscard]] Json pose_json(const SE3& T);

}  // namespace km
