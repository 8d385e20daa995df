#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Distances of points from the faces of a mesh, up to a bound.
class SurfaceDistance {
 public:
  /// `mesh` must live as long as this.
  SurfaceDistance(const LabelledMesh& mesh, double bound_m) : mesh_(mesh), bound_m_(bound_m) {
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
      Eigen::Vector3d low = corner(i, 0), high = low;
      for (std::size_t c = 1; c < 3; ++c) {
        low = low.cwiseMin(corner(i, c));
        high = high.cwiseMax(corner(i, c));
      }
      visit(low, high, [&](const Cell& cell) { faces_[cell].push_back(i); });
    }
  }

  /// The bound if there is no face within it [m].
  [[nodiscard]] double operator()(const Eigen::Vector3d& p) const {
    double best = bound_m_;
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(bound_m_);
    visit(p - reach, p + reach, [&](const Cell& cell) {
      const auto found = faces_.find(cell);
      if (found == faces_.end()) return;
      for (const std::size_t face : found->second)
        best = std::min(best, distance(p, corner(face, 0), corner(face, 1), corner(face, 2)));
    });
    return best;
  }

 private:
  using Cell = std::array<int, 3>;

  static constexpr double kCell_m = 0.1;

  [[nodiscard]] Eigen::Vector3d corner(std::size_t face, std::size_t c) const {
    return mesh_.vertices[mesh_.faces[face][c]].cast<double>();
  }

  template <typename Visit>
  static void visit(const Eigen::Vector3d& low, const Eigen::Vector3d& high, const Visit& each) {
    const Eigen::Array3i first = (low / kCell_m).array().floor().cast<int>();
    const Eigen::Array3i last = (high / kCell_m).array().floor().cast<int>();
    for (int z = first.z(); z <= last.z(); ++z)
      for (int y = first.y(); y <= last.y(); ++y)
        for (int x = first.x(); x <= last.x(); ++x) each(Cell{x, y, z});
  }

  // From the segment a b.
  static double distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b) {
    const Eigen::Vector3d along = b - a;
    const double t = (p - a).dot(along) / std::max(along.squaredNorm(), 1e-300);
    return (a + std::clamp(t, 0.0, 1.0) * along - p).norm();
  }

  // From the triangle: its plane if the foot lies inside, else the nearest side.
  static double distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const bool inside = normal.dot((b - a).cross(p - a)) > 0.0 &&
                        normal.dot((c - b).cross(p - b)) > 0.0 &&
                        normal.dot((a - c).cross(p - c)) > 0.0;
    if (inside) return std::abs(normal.dot(p - a)) / normal.norm();
    return std::min({distance(p, a, b), distance(p, b, c), distance(p, c, a)});
  }

  const LabelledMesh& mesh_;
  double bound_m_;
  std::map<Cell, std::vector<std::size_t>> faces_;
};

}  // namespace km
