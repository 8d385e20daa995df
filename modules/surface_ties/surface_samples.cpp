#include "modules/surface_ties/surface_samples.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>

namespace km {
namespace {

constexpr double kLeastArea = 0.25;       // share of the area of a full cell
constexpr double kLeastCoherence = 0.85;  // length of the mean normal; 1: all are equal

// Cell, and the main direction of the normal.
using Key = std::array<std::int64_t, 4>;

struct Sum {
  double area = 0.0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   // times area
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // times area
  std::map<LabelId, double> labels = {};             // area of each
};

std::int64_t main_direction(const Eigen::Vector3d& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (normal[axis] < 0.0 ? 1 : 0);
}

void add_face(const LabelledMesh& mesh, std::size_t face, double spacing_m,
              std::map<Key, Sum>& sums) {
  const auto corner = [&](std::size_t k) -> Eigen::Vector3d {
    return mesh.vertices[mesh.faces[face][k]].cast<double>();
  };
  const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
  const Eigen::Vector3d normal = 0.5 * (b - a).cross(c - a);
  const double area = normal.norm();
  if (!(area > 0.0)) return;
  const Eigen::Vector3d centre = (a + b + c) / 3.0;
  const Eigen::Vector3d cell = (centre / spacing_m).array().floor();
  Sum& sum = sums[{static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
                   static_cast<std::int64_t>(cell.z()), main_direction(normal)}];
  sum.area += area;
  sum.point += area * centre;
  sum.normal += normal;
  sum.labels[mesh.face_label(face)] += area;
}

// The label with the largest area; of several, the lowest.
LabelId main_label(const std::map<LabelId, double>& labels) {
  LabelId best = labels.begin()->first;
  for (const auto& [label, area] : labels)
    if (area > labels.at(best)) best = label;
  return best;
}

}  // namespace

std::vector<SurfaceSample> sample_plane_patches(const LabelledMesh& mesh, double spacing_m) {
  if (!(spacing_m > 0.0))
    throw std::invalid_argument("surface samples: a spacing of " + std::to_string(spacing_m) +
                                " m");
  std::map<Key, Sum> sums;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) add_face(mesh, f, spacing_m, sums);
  std::vector<SurfaceSample> samples;
  for (const auto& [key, sum] : sums) {
    const double length = sum.normal.norm();
    if (sum.area < kLeastArea * spacing_m * spacing_m || length < kLeastCoherence * sum.area)
      continue;
    samples.push_back({sum.point / sum.area, sum.normal / length, main_label(sum.labels)});
  }
  return samples;
}

void transform(std::vector<SurfaceSample>& samples, const SE3& T_a_b) {
  for (SurfaceSample& sample : samples) {
    sample.point = T_a_b * sample.point;
    sample.normal = T_a_b.linear() * sample.normal;
  }
}

}  // namespace km
