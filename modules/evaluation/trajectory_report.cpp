#include "modules/evaluation/trajectory_report.hpp"

#include <algorithm>
#include <iomanip>
#include <limits>
#include <sstream>

namespace km {
namespace {

void write_row(std::ostream& out, int name_width, const TrajectoryError& e) {
  const auto number = [&](int width, int decimals, double value) {
    out << ' ' << std::setw(width) << std::setprecision(decimals) << value;
  };
  const auto rmse_or_dash = [&](int width, int decimals, const Statistics& errors) {
    if (errors.count > 0) return number(width, decimals, errors.rmse);
    out << ' ' << std::setw(width) << '-';
  };
  out << std::left << std::setw(name_width) << e.name << std::right << ' ' << std::setw(6)
      << e.position_m.count;
  number(9, 4, e.position_m.rmse);
  number(8, 4, e.position_m.mean);
  number(8, 4, e.position_m.median);
  number(8, 4, e.position_m.max);
  number(9, 3, e.rotation_deg.rmse);
  rmse_or_dash(9, 4, e.rpe_translation_m);
  rmse_or_dash(9, 3, e.rpe_rotation_deg);
  number(8, 1, 100.0 * e.completeness);
  out << "%\n";
}

bool lacks_relative(const TrajectoryError& error) {
  return error.rpe_translation_m.count == 0;
}

// Null for what an empty sample does not have: zeros would be perfect scores.
void write_statistics(JsonWriter& json, const char* name, const Statistics& statistics) {
  const auto number = [&](const char* key, double value) {
    json.field(key, statistics.count > 0 ? value : std::numeric_limits<double>::quiet_NaN());
  };
  json.key(name);
  json.begin_object();
  number("rmse", statistics.rmse);
  number("mean", statistics.mean);
  number("median", statistics.median);
  number("max", statistics.max);
  json.field("count", statistics.count);
  json.end_object();
}

void write_alignment(JsonWriter& json, const Alignment& alignment) {
  const Eigen::Quaterniond q(alignment.T_truth_estimate.linear());
  json.begin_object();
  json.field("scale", alignment.scale);
  json.array("translation_m", alignment.T_truth_estimate.translation());
  json.array("rotation_xyzw", q.coeffs());
  json.end_object();
}

}  // namespace

std::string to_table(const TeamError& team) {
  std::size_t width = 8;
  for (const TrajectoryError& robot : team.robots) width = std::max(width, robot.name.size());
  const int name_width = static_cast<int>(width);
  std::ostringstream out;
  out << std::fixed << std::setw(name_width) << ""
      << "        ---------- position error [m] ----  rotation  relative, per delta\n"
      << std::left << std::setw(name_width) << "estimate" << std::right
      << "  pairs      rmse     mean   median      max rmse[deg]  rmse[m] rmse[deg]  covered\n";
  for (const TrajectoryError& robot : team.robots) write_row(out, name_width, robot);
  if (team.robots.size() > 1) write_row(out, name_width, team.joint);
  if (std::any_of(team.robots.begin(), team.robots.end(), lacks_relative))
    out << "-: no two compared poses lie one delta apart, so there is no relative error\n";
  return out.str();
}

void write_json(JsonWriter& json, const TrajectoryError& error) {
  json.begin_object();
  json.field("name", error.name);
  json.field("poses", error.poses);
  json.field("pairs", error.position_m.count);
  json.field("completeness", error.completeness);
  write_statistics(json, "position_m", error.position_m);
  write_statistics(json, "rotation_deg", error.rotation_deg);
  write_statistics(json, "rpe_translation_m", error.rpe_translation_m);
  write_statistics(json, "rpe_rotation_deg", error.rpe_rotation_deg);
  json.array("segment_lengths_m", error.segment_lengths_m);
  write_statistics(json, "drift_percent", error.drift_percent);
  write_statistics(json, "drift_deg_per_m", error.drift_deg_per_m);
  json.end_object();
}

void write_json(JsonWriter& json, const TeamError& team) {
  json.begin_object();
  json.key("alignment");
  write_alignment(json, team.alignment);
  json.key("robots");
  json.begin_array();
  for (const TrajectoryError& robot : team.robots) write_json(json, robot);
  json.end_array();
  json.key("joint");
  write_json(json, team.joint);
  json.end_object();
}

}  // namespace km
