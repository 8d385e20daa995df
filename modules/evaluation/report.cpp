#include "modules/evaluation/report.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "modules/core/io/text_table.hpp"

namespace km {
namespace {

std::string cell(const Json& row, const ReportColumn& column) {
  const Json::json_pointer place(column.place);
  if (!row.contains(place) || row.at(place).is_null()) return "-";
  const Json& value = row.at(place);
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_integer()) return value.dump();
  const double number = column.factor * value.get<double>();
  return std::isfinite(number) ? fixed(number, column.decimals) + column.unit : "-";
}

}  // namespace

std::string report_table(const Json& rows, std::span<const ReportColumn> columns) {
  std::vector<std::vector<std::string>> cells(1);
  for (const ReportColumn& column : columns) cells.front().emplace_back(column.heading);
  for (const Json& row : rows) {
    cells.emplace_back();
    for (const ReportColumn& column : columns) cells.back().push_back(cell(row, column));
  }
  return align_columns(cells);
}

void to_json(Json& json, const Statistics& statistics) {
  const auto number = [&](double value) { return statistics.count > 0 ? Json(value) : Json(); };
  json = {{"rmse", number(statistics.rmse)},
          {"mean", number(statistics.mean)},
          {"median", number(statistics.median)},
          {"max", number(statistics.max)},
          {"count", statistics.count}};
}

Json pose_json(const SE3& T) {
  const Eigen::Vector3d t = T.translation();
  const Eigen::Quaterniond q(T.linear());
  return {{"translation_m", {t.x(), t.y(), t.z()}},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

}  // namespace km
