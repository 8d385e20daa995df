#include "apps/evaluate/map_quality.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/core/quantile.hpp"
#include "modules/evaluation/mesh/sampled_surface.hpp"
#include "modules/evaluation/report.hpp"

namespace km {
namespace {

constexpr double kSamplesPerM2 = 400.0;
constexpr double kReach_m = 0.5;
constexpr float kOnPlane_m = 0.3F;        // distance up to which a face belongs to a true plane
constexpr float kPlaneCell_m = 0.5F;      // side of the cells in which planes are fitted
constexpr std::size_t kLeastInCell = 10;  // samples of a plane

std::array<bool, 256> labels_named(const LabelPalette& palette,
                                   std::initializer_list<const char*> names) {
  std::array<bool, 256> found = {};
  for (const LabelClass& entry : palette.classes())
    found[entry.id] = std::ranges::find(names, entry.name) != names.end();
  return found;
}

void count(MappedShare& share, float distance_m) {
  ++share.points;
  share.within_5cm += distance_m <= 0.05F ? 1.0 : 0.0;
  share.within_20cm += distance_m <= 0.20F ? 1.0 : 0.0;
}

void finish(MappedShare& share) {
  share.within_5cm /= static_cast<double>(share.points);
  share.within_20cm /= static_cast<double>(share.points);
}

void judge_seen(const LabelledMesh& map, const SurfaceSamples& samples,
                std::span<const SeenPoint> seen, MapQuality& quality) {
  const NearestSurface nearest(map, samples);
  for (const SeenPoint& point : seen) {
    const auto near = nearest.find(point.point, kReach_m);
    const float distance_m = near ? near->surface_m : std::numeric_limits<float>::infinity();
    const auto band = std::ranges::upper_bound(MapQuality::kDepths_m, point.depth_m);
    if (band == MapQuality::kDepths_m.end()) continue;
    const auto place = static_cast<std::size_t>(band - MapQuality::kDepths_m.begin());
    count(quality.by_depth[place], distance_m);
    if (place < 2) count(quality.by_class[point.label], distance_m);
  }
  for (MappedShare& share : quality.by_depth) finish(share);
  for (MappedShare& share : quality.by_class) finish(share);
}

// Rms distances of samples to a plane that is fitted to them, for each cell and true plane.
class LocalPlanes {
 public:
  void add(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, float offset_m) {
    const auto cell = [](float value, float side) {
      return static_cast<int>(std::floor(value / side));
    };
    Sum& sum = sums_[{cell(point.x(), kPlaneCell_m), cell(point.y(), kPlaneCell_m),
                      cell(point.z(), kPlaneCell_m), cell(normal.x() + 0.05F, 0.1F),
                      cell(normal.y() + 0.05F, 0.1F), cell(offset_m + 0.025F, 0.05F)}];
    ++sum.count;
    const Eigen::Vector3d p = point.cast<double>();
    sum.sum += p;
    sum.square += p * p.transpose();
  }

  [[nodiscard]] std::vector<float> rms_mm() const {
    std::vector<float> result;
    for (const auto& [cell, sum] : sums_) {
      if (sum.count < kLeastInCell) continue;
      const auto n = static_cast<double>(sum.count);
      const Eigen::Vector3d mean = sum.sum / n;
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
          sum.square / n - mean * mean.transpose(), Eigen::EigenvaluesOnly);
      result.push_back(static_cast<float>(1e3 * std::sqrt(std::max(solver.eigenvalues()[0], 0.0))));
    }
    return result;
  }

 private:
  struct Sum {
    std::size_t count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  };
  std::map<std::array<int, 6>, Sum> sums_;
};

void judge_map(const LabelledMesh& truth, const LabelledMesh& map, const SurfaceSamples& samples,
               const LabelPalette& palette, MapQuality& quality) {
  NearbyCells nearby(kReach_m);
  nearby.add(samples.points);
  const SurfaceSamples true_samples = sample_surface(truth, kSamplesPerM2, 1, &nearby);
  const NearestSurface nearest(truth, true_samples);
  const auto is_wall = labels_named(palette, {"building", "wall"});
  const auto is_floor = labels_named(palette, {"road", "floor"});
  std::vector<float> distances_m, wall_deg, floor_deg;
  LocalPlanes planes;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const auto near = nearest.find(samples.points[i], kReach_m);
    distances_m.push_back(near ? near->surface_m : static_cast<float>(kReach_m));
    if (!near || near->surface_m > kOnPlane_m) continue;
    const LabelId label = truth.face_label(near->face);
    if (!is_wall[label] && !is_floor[label]) continue;
    const Eigen::Vector3f normal = truth.face_normal(near->face).normalized();
    const float cosine = std::abs(normal.dot(map.face_normal(samples.faces[i]).normalized()));
    (is_wall[label] ? wall_deg : floor_deg)
        .push_back(static_cast<float>(kDegrees) * std::acos(std::min(cosine, 1.0F)));
    if (is_wall[label])
      planes.add(samples.points[i], normal, normal.dot(truth.vertices[truth.faces[near->face][0]]));
  }
  const auto share = [&](float limit) {
    return static_cast<double>(
               std::ranges::count_if(distances_m, [&](float d) { return d <= limit; })) /
           static_cast<double>(distances_m.size());
  };
  quality.within_5cm = share(0.05F);
  quality.within_10cm = share(0.10F);
  quality.median_mm = 1e3 * quantile(distances_m, 0.5);
  quality.wall_deg = quantile(std::move(wall_deg), 0.5);
  quality.floor_deg = quantile(std::move(floor_deg), 0.5);
  quality.wall_rms_mm = quantile(planes.rms_mm(), 0.5);
}

double open_edges_m(const LabelledMesh& mesh) {
  std::unordered_map<std::uint64_t, int> faces_of;
  const auto visit = [&](const auto& use) {
    for (const auto& face : mesh.faces)
      for (std::size_t i = 0; i < 3; ++i) {
        const auto [low, high] = std::minmax(face[i], face[(i + 1) % 3]);
        use(std::uint64_t{low} << 32U | high, low, high);
      }
  };
  visit([&](std::uint64_t edge, auto, auto) { ++faces_of[edge]; });
  double length_m = 0.0;
  visit([&](std::uint64_t edge, auto a, auto b) {
    if (faces_of[edge] == 1)
      length_m += static_cast<double>((mesh.vertices[a] - mesh.vertices[b]).norm());
  });
  return length_m;
}

Json to_json(const MappedShare& part) {
  return {
      {"points", part.points}, {"within_5cm", part.within_5cm}, {"within_20cm", part.within_20cm}};
}

}  // namespace

MapQuality map_quality(const LabelledMesh& truth, const LabelledMesh& map,
                       std::span<const SeenPoint> seen, const LabelPalette& palette) {
  MapQuality quality;
  const SurfaceSamples samples = sample_surface(map, kSamplesPerM2, 2);
  judge_seen(map, samples, seen, quality);
  judge_map(truth, map, samples, palette, quality);
  quality.rim_m_per_m2 = open_edges_m(map) / surface_area(map);
  return quality;
}

std::string to_table(const MapQuality& quality, const LabelPalette& palette) {
  constexpr ReportColumn kColumns[] = {{"seen", "/name"},
                                       {"points", "/points"},
                                       percent_column("<20cm", "/within_20cm"),
                                       percent_column("<5cm", "/within_5cm")};
  Json rows = Json::array();
  const auto add = [&](const std::string& name, const MappedShare& part) {
    if (part.points == 0) return;
    rows.push_back(to_json(part));
    rows.back()["name"] = name;
  };
  for (std::size_t i = 0; i < quality.by_depth.size(); ++i)
    add("below " + fixed(static_cast<double>(MapQuality::kDepths_m[i]), 0) + " m",
        quality.by_depth[i]);
  for (const LabelClass& entry : palette.classes()) add(entry.name, quality.by_class[entry.id]);
  return report_table(rows, kColumns) + "\nmap within 5 cm of the truth " +
         fixed(100.0 * quality.within_5cm, 1) + " %, 10 cm " +
         fixed(100.0 * quality.within_10cm, 1) + " %, median " + fixed(quality.median_mm, 1) +
         " mm; walls " + fixed(quality.wall_deg, 1) + " deg, " + fixed(quality.wall_rms_mm, 1) +
         " mm rms; floor " + fixed(quality.floor_deg, 1) + " deg; open edges " +
         fixed(quality.rim_m_per_m2, 2) + " m/m2\n";
}

Json to_json(const MapQuality& quality, const LabelPalette& palette) {
  Json json = {{"within_5cm", quality.within_5cm},     {"within_10cm", quality.within_10cm},
               {"median_mm", quality.median_mm},       {"wall_deg", quality.wall_deg},
               {"wall_rms_mm", quality.wall_rms_mm},   {"floor_deg", quality.floor_deg},
               {"rim_m_per_m2", quality.rim_m_per_m2}, {"by_depth", Json::array()}};
  for (const MappedShare& part : quality.by_depth) json["by_depth"].push_back(to_json(part));
  for (const LabelClass& entry : palette.classes())
    if (quality.by_class[entry.id].points > 0)
      json["by_class"][entry.name] = to_json(quality.by_class[entry.id]);
  return json;
}

}  // namespace km
