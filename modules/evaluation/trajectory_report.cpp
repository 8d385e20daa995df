#include "modules/evaluation/trajectory_report.hpp"

#include <algorithm>
#include <iomanip>
#include <sstream>

namespace km {
namespace {

void write_row(std::ostream& out, int name_width, const TrajectoryError& e) {
  const auto number = [&](int width, int decimals, double value) {
    out << ' ' << std::setw(width) << std::setprecision(decimals) << value;
  };
  out << std::left << std::setw(name_width) << e.name << std::right << ' ' << std::setw(6)
      << e.position_m.count;
  number(9, 4, e.position_m.rmse);
  number(8, 4, e.position_m.mean);
  number(8, 4, e.position_m.median);
  number(8, 4, e.position_m.max);
  number(9, 3, e.rotation_deg.rmse);
  number(9, 4, e.rpe_translation_m.rmse);
  number(9, 3, e.rpe_rotation_deg.rmse);
  number(8, 1, 100.0 * e.completeness);
  out << "%\n";
}

void write_statistics(JsonWriter& json, const char* name, const Statistics& statistics) {
  json.key(name);
  json.begin_object();
  json.field("rmse", statistics.rmse);
  json.field("mean", statistics.mean);
  json.field("median", statistics.median);
  json.field("max", statistics.max);
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
