#include "modules/evaluation/mesh/mesh_report.hpp"

#include <nlohmann/json.hpp>
#include <sstream>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/evaluation/report.hpp"

namespace km {
namespace {

std::string class_name(LabelId id, const LabelPalette& palette) {
  const LabelClass* found = palette.find(id);
  return found != nullptr ? found->name : "class " + std::to_string(id);
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
  Json json = pose_json(registration.T_truth_estimate);
  json.update({{"moved_m", moved_m},
               {"iterations", registration.iterations},
               {"converged", registration.converged},
               {"free_directions", registration.free_directions},
               {"pairs", registration.pairs},
               {"rms_m", registration.rms_m}});
  return json;
}

// The meshes of a report, and all together if they are several.
Json meshes_of(const Json& report) {
  Json meshes = report["robots"];
  if (meshes.size() > 1) meshes.push_back(report["merged"]);
  for (Json& mesh : meshes) mesh["near_truth"] = 1.0 - mesh["beyond"].get<double>();
  return meshes;
}

// One direction of the comparison, a row per mesh. `share` is the key of the covered share.
std::string direction_table(const Json& report, const char* direction, const char* share) {
  constexpr ReportColumn kColumns[] = {{"estimate", "/name"},
                                       {"points", "/point/count"},
                                       {"mean", "/point/mean_m", 1, 1e3},
                                       {"median", "/point/median_m", 1, 1e3},
                                       {"p95", "/point/p95_m", 1, 1e3},
                                       percent_column("<5cm", "/point/within_5cm"),
                                       percent_column("<10cm", "/point/within_10cm"),
                                       {"surface", "/surface/mean_m", 1, 1e3},
                                       percent_column("labels", "/labels/accuracy"),
                                       percent_column("covered", "/covered")};
  Json rows = Json::array();
  for (const Json& mesh : meshes_of(report)) {
    rows.push_back(mesh[direction]);
    rows.back().update({{"name", mesh["name"]}, {"covered", mesh[share]}});
  }
  return report_table(rows, kColumns);
}

std::string class_table(const Json& labels) {
  constexpr ReportColumn kClassColumns[] = {{"class", "/name"},
                                            {"points", "/points"},
                                            percent_column("right", "/accuracy"),
                                            percent_column("wrong", "/wrong_share"),
                                            percent_column("unknown", "/unknown_share")};
  Json rows = labels["classes"];
  rows.push_back(labels);
  rows.back()["name"] = "all";
  for (Json& row : rows) {
    const double points = row["points"];
    row["wrong_share"] = row["wrong"].get<double>() / points;
    row["unknown_share"] = row["unknown"].get<double>() / points;
  }
  return report_table(rows, kClassColumns);
}

}  // namespace

std::string to_table(const MeshReport& report, const LabelPalette& palette) {
  const Json json = to_json(report, palette);
  std::ostringstream out;
  out << "Distances in mm. Each true point to the nearest estimated one:\n"
      << direction_table(json, "truth_to_estimate", "coverage")
      << "\nOnly true points with the estimate in front, neither past its rim nor behind it:\n"
      << direction_table(json, "seen_truth_to_estimate", "seen_coverage")
      << "\nEach estimated point to the nearest true one:\n"
      << direction_table(json, "estimate_to_truth", "near_truth");
  if (report.has_labels)
    out << "\nTrue class, of points with " << report.merged.name << " in front:\n"
        << class_table(json["merged"]["seen_truth_to_estimate"]["labels"]);
  const SE3& T = report.registration.T_truth_estimate;
  const Eigen::Vector3d turn_deg =
      kDegrees * Eigen::AngleAxisd(T.linear()).angle() * Eigen::AngleAxisd(T.linear()).axis();
  const auto vector = [](const Eigen::Vector3d& v) {
    return fixed(v.x(), 4) + ", " + fixed(v.y(), 4) + ", " + fixed(v.z(), 4);
  };
  out << "\nEstimate moved into the truth by [" << vector(T.translation())
      << "] m, rotation vector [" << vector(turn_deg) << "] deg";
  if (report.registration.iterations > 0)
    out << "; of this by ICP " << fixed(1e3 * report.moved_m, 1) << " mm at most, in "
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
