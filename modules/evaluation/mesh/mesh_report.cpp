#include "modules/evaluation/mesh/mesh_report.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "modules/core/geometry.hpp"
#include "modules/core/text_table.hpp"

namespace km {
namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string percent(double share) {
  return std::isnan(share) ? "-" : fixed(100.0 * share, 1) + '%';
}

std::string millimetres(double metres) {
  return fixed(1e3 * metres, 1);
}

std::string class_name(LabelId id, const LabelPalette& palette) {
  const LabelClass* found = palette.find(id);
  return found != nullptr ? found->name : "class " + std::to_string(id);
}

std::vector<const MeshError*> rows_of(const MeshReport& report) {
  std::vector<const MeshError*> rows;
  for (const MeshError& robot : report.robots) rows.push_back(&robot);
  if (rows.size() > 1) rows.push_back(&report.merged);
  return rows;
}

// One direction of the comparison, a row per mesh.
std::string direction_table(const MeshReport& report, SurfaceComparison MeshError::*way,
                            const auto& covered) {
  Rows rows = {{"estimate", "points", "mean", "median", "p95", "<5cm", "<10cm", "surface", "labels",
                "covered"}};
  for (const MeshError* mesh : rows_of(report)) {
    const auto& [point, surface, labels] = mesh->*way;
    rows.push_back({mesh->name, std::to_string(point.count), millimetres(point.mean_m),
                    millimetres(point.median_m), millimetres(point.p95_m),
                    percent(point.within_5cm), percent(point.within_10cm),
                    millimetres(surface.mean_m), percent(labels.total().accuracy()),
                    percent(covered(*mesh))});
  }
  return align_columns(rows);
}

std::string class_table(const MeshReport& report, const LabelPalette& palette) {
  Rows rows = {{"class", "points", "right", "wrong", "unknown"}};
  const auto add = [&](const std::string& name, const LabelScore& score) {
    const auto points = static_cast<double>(score.points());
    rows.push_back({name, std::to_string(score.points()),
                    percent(static_cast<double>(score.right) / points),
                    percent(static_cast<double>(score.wrong) / points),
                    percent(static_cast<double>(score.unknown) / points)});
  };
  for (const LabelScore& score : report.merged.seen.labels.by_class())
    add(class_name(score.id, palette), score);
  add("all", report.merged.seen.labels.total());
  return align_columns(rows);
}

Json to_json(const DistanceSummary& summary) {
  return {{"count", summary.count},           {"mean_m", summary.mean_m},
          {"median_m", summary.median_m},     {"p95_m", summary.p95_m},
          {"within_5cm", summary.within_5cm}, {"within_10cm", summary.within_10cm}};
}

Json to_json(const LabelScore& score) {
  return {{"points", score.points()},
          {"right", score.right},
          {"wrong", score.wrong},
          {"unknown", score.unknown},
          {"accuracy", score.accuracy()}};
}

Json to_json(const LabelConfusion& labels, const LabelPalette& palette) {
  Json json = to_json(labels.total());
  Json& classes = json["classes"] = Json::array();
  for (const LabelScore& score : labels.by_class()) {
    classes.push_back({{"id", score.id}, {"name", class_name(score.id, palette)}});
    classes.back().update(to_json(score));
  }
  return json;
}

Json to_json(const SurfaceComparison& comparison, bool has_labels, const LabelPalette& palette) {
  return {{"point", to_json(comparison.point)},
          {"surface", to_json(comparison.surface)},
          {"labels", has_labels ? to_json(comparison.labels, palette) : Json()}};
}

Json to_json(const MeshError& error, bool has_labels, const LabelPalette& palette) {
  return {{"name", error.name},
          {"area_m2", error.area_m2},
          {"faces", error.faces},
          {"coverage", error.coverage},
          {"seen_coverage", error.seen_coverage},
          {"beyond", error.beyond},
          {"truth_to_estimate", to_json(error.truth, has_labels, palette)},
          {"seen_truth_to_estimate", to_json(error.seen, has_labels, palette)},
          {"estimate_to_truth", to_json(error.estimate, has_labels, palette)}};
}

Json to_json(const Registration& registration, double moved_m) {
  const Eigen::Vector3d t = registration.T_truth_estimate.translation();
  const Eigen::Quaterniond q(registration.T_truth_estimate.linear());
  return {{"translation_m", {t.x(), t.y(), t.z()}},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"moved_m", moved_m},
          {"iterations", registration.iterations},
          {"converged", registration.converged},
          {"free_directions", registration.free_directions},
          {"pairs", registration.pairs},
          {"rms_m", registration.rms_m}};
}

}  // namespace

std::string to_table(const MeshReport& report, const LabelPalette& palette) {
  std::ostringstream out;
  out << "Distances in mm. Each true point to the nearest estimated one:\n"
      << direction_table(report, &MeshError::truth, [](auto& mesh) { return mesh.coverage; })
      << "\nOnly true points with the estimate in front, neither past its rim nor behind it:\n"
      << direction_table(report, &MeshError::seen, [](auto& mesh) { return mesh.seen_coverage; })
      << "\nEach estimated point to the nearest true one:\n"
      << direction_table(report, &MeshError::estimate,
                         [](auto& mesh) { return 1.0 - mesh.beyond; });
  if (report.has_labels)
    out << "\nTrue class, of points with " << report.merged.name << " in front:\n"
        << class_table(report, palette);
  const SE3& T = report.registration.T_truth_estimate;
  const Eigen::Vector3d turn_deg =
      kDegrees * Eigen::AngleAxisd(T.linear()).angle() * Eigen::AngleAxisd(T.linear()).axis();
  const auto vector = [](const Eigen::Vector3d& v) {
    return fixed(v.x(), 4) + ", " + fixed(v.y(), 4) + ", " + fixed(v.z(), 4);
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

Json to_json(const MeshReport& report, const LabelPalette& palette) {
  Json robots = Json::array();
  for (const MeshError& robot : report.robots)
    robots.push_back(to_json(robot, report.has_labels, palette));
  return {{"registration", to_json(report.registration, report.moved_m)},
          {"samples_per_m2", report.samples_per_m2},
          {"robots", std::move(robots)},
          {"merged", to_json(report.merged, report.has_labels, palette)},
          {"notes", report.notes}};
}

}  // namespace km
