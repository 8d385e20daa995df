#include "modules/evaluation/mesh/mesh_report.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace km {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

std::string number(double value, int decimals, const char* unit = "") {
  if (std::isnan(value)) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << value << unit;
  return text.str();
}

std::string percent(double share) {
  return number(100.0 * share, 1, "%");
}

std::string millimetres(double metres) {
  return number(1e3 * metres, 1);
}

std::string class_name(LabelId id, const LabelPalette& palette) {
  const LabelClass* found = palette.find(id);
  return found != nullptr ? found->name : "class " + std::to_string(id);
}

// First column to the left, the others to the right.
void write_row(std::ostream& out, int name_width, const std::string& name,
               const std::vector<std::string>& cells) {
  out << std::left << std::setw(name_width) << name << std::right;
  for (const std::string& cell : cells) out << ' ' << std::setw(9) << cell;
  out << '\n';
}

void write_direction(std::ostream& out, int name_width, const std::string& name,
                     const SurfaceComparison& comparison, double covered) {
  const DistanceSummary& point = comparison.point;
  write_row(out, name_width, name,
            {std::to_string(point.count), millimetres(point.mean_m), millimetres(point.median_m),
             millimetres(point.p95_m), percent(point.within_5cm), percent(point.within_10cm),
             millimetres(comparison.surface.mean_m), percent(comparison.labels.total().accuracy()),
             percent(covered)});
}

std::vector<const MeshError*> rows_of(const MeshReport& report) {
  std::vector<const MeshError*> rows;
  for (const MeshError& robot : report.robots) rows.push_back(&robot);
  if (rows.size() > 1) rows.push_back(&report.merged);
  return rows;
}

int name_width(const MeshReport& report) {
  std::size_t width = 14;
  for (const MeshError& robot : report.robots) width = std::max(width, robot.name.size());
  return static_cast<int>(width);
}

void write_distances(std::ostream& out, const MeshReport& report) {
  const int width = name_width(report);
  const std::vector<std::string> columns = {"points", "mean",    "median", "p95",    "<5cm",
                                            "<10cm",  "surface", "labels", "covered"};
  out << "Distances in mm. Each true point to the nearest estimated one:\n";
  write_row(out, width, "estimate", columns);
  for (const MeshError* row : rows_of(report))
    write_direction(out, width, row->name, row->truth, row->coverage);
  out << "\nOnly true points with the estimate in front, neither past its rim nor behind it:\n";
  write_row(out, width, "estimate", columns);
  for (const MeshError* row : rows_of(report))
    write_direction(out, width, row->name, row->seen, row->seen_coverage);
  out << "\nEach estimated point to the nearest true one:\n";
  write_row(out, width, "estimate", columns);
  for (const MeshError* row : rows_of(report))
    write_direction(out, width, row->name, row->estimate, 1.0 - row->beyond);
}

void write_classes(std::ostream& out, const MeshReport& report, const LabelPalette& palette) {
  if (!report.has_labels) return;
  const int width = name_width(report);
  out << "\nTrue class, of points with " << report.merged.name << " in front:\n";
  write_row(out, width, "class", {"points", "right", "wrong", "unknown"});
  const auto write = [&](const std::string& name, const LabelScore& score) {
    const auto points = static_cast<double>(score.points());
    write_row(out, width, name,
              {std::to_string(score.points()), percent(static_cast<double>(score.right) / points),
               percent(static_cast<double>(score.wrong) / points),
               percent(static_cast<double>(score.unknown) / points)});
  };
  for (const LabelScore& score : report.merged.seen.labels.by_class())
    write(class_name(score.id, palette), score);
  write("all", report.merged.seen.labels.total());
}

void write_json(JsonWriter& json, const DistanceSummary& summary) {
  json.begin_object();
  json.field("count", summary.count);
  json.field("mean_m", summary.mean_m);
  json.field("median_m", summary.median_m);
  json.field("p95_m", summary.p95_m);
  json.field("within_5cm", summary.within_5cm);
  json.field("within_10cm", summary.within_10cm);
  json.end_object();
}

void write_fields(JsonWriter& json, const LabelScore& score) {
  json.field("points", score.points());
  json.field("right", score.right);
  json.field("wrong", score.wrong);
  json.field("unknown", score.unknown);
  json.field("accuracy", score.accuracy());
  json.field("accuracy_of_known", score.accuracy_of_known());
}

void write_json(JsonWriter& json, const LabelConfusion& labels, const LabelPalette& palette) {
  json.begin_object();
  write_fields(json, labels.total());
  json.key("classes");
  json.begin_array();
  for (const LabelScore& score : labels.by_class()) {
    json.begin_object();
    json.field("id", static_cast<int>(score.id));
    json.field("name", class_name(score.id, palette));
    write_fields(json, score);
    json.end_object();
  }
  json.end_array();
  json.end_object();
}

void write_json(JsonWriter& json, const char* name, const SurfaceComparison& comparison,
                bool has_labels, const LabelPalette& palette) {
  json.key(name);
  json.begin_object();
  json.key("point");
  write_json(json, comparison.point);
  json.key("surface");
  write_json(json, comparison.surface);
  if (has_labels) {
    json.key("labels");
    write_json(json, comparison.labels, palette);
  } else {
    json.field("labels", std::nan(""));  // null
  }
  json.end_object();
}

void write_json(JsonWriter& json, const MeshError& error, bool has_labels,
                const LabelPalette& palette) {
  json.begin_object();
  json.field("name", error.name);
  json.field("area_m2", error.area_m2);
  json.field("faces", error.faces);
  json.field("coverage", error.coverage);
  json.field("seen_coverage", error.seen_coverage);
  json.field("beyond", error.beyond);
  write_json(json, "truth_to_estimate", error.truth, has_labels, palette);
  write_json(json, "seen_truth_to_estimate", error.seen, has_labels, palette);
  write_json(json, "estimate_to_truth", error.estimate, has_labels, palette);
  json.end_object();
}

void write_json(JsonWriter& json, const Registration& registration, double moved_m) {
  const Eigen::Quaterniond q(registration.T_truth_estimate.linear());
  json.key("registration");
  json.begin_object();
  json.array("translation_m", registration.T_truth_estimate.translation());
  json.array("rotation_xyzw", q.coeffs());
  json.field("moved_m", moved_m);
  json.field("iterations", registration.iterations);
  json.field("converged", registration.converged);
  json.field("free_directions", registration.free_directions);
  json.field("pairs", registration.pairs);
  json.field("rms_m", registration.rms_m);
  json.end_object();
}

}  // namespace

std::string to_table(const MeshReport& report, const LabelPalette& palette) {
  std::ostringstream out;
  write_distances(out, report);
  write_classes(out, report, palette);
  const SE3& T = report.registration.T_truth_estimate;
  const Eigen::Vector3d turn_deg =
      kDegrees * Eigen::AngleAxisd(T.linear()).angle() * Eigen::AngleAxisd(T.linear()).axis();
  const auto vector = [](const Eigen::Vector3d& v) {
    return number(v.x(), 4) + ", " + number(v.y(), 4) + ", " + number(v.z(), 4);
  };
  out << "\nEstimate moved into the truth by [" << vector(T.translation())
      << "] m, rotation vector [" << vector(turn_deg) << "] deg";
  if (report.registration.iterations > 0)
    out << "; of this by ICP " << millimetres(report.moved_m) << " mm at most, in "
        << report.registration.iterations << " iterations";
  out << '\n';
  for (const std::string& note : report.notes) out << "note: " << note << '\n';
  return out.str();
}

void write_json(JsonWriter& json, const MeshReport& report, const LabelPalette& palette) {
  json.begin_object();
  write_json(json, report.registration, report.moved_m);
  json.field("samples_per_m2", report.samples_per_m2);
  json.key("robots");
  json.begin_array();
  for (const MeshError& robot : report.robots) write_json(json, robot, report.has_labels, palette);
  json.end_array();
  json.key("merged");
  write_json(json, report.merged, report.has_labels, palette);
  json.array("notes", report.notes);
  json.end_object();
}

}  // namespace km
