#include "modules/vio/two_point_ransac.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace km {
namespace {

std::vector<bool> inliers_of(std::span<const BearingPair> pairs, const Eigen::Matrix3d& R,
                             const Eigen::Vector3d& direction, double threshold) {
  std::vector<bool> inlier(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    inlier[i] = epipolar_distance(pairs[i], R, direction) < threshold;
  }
  return inlier;
}

// Truncated quadratic cost (MSAC): finer than counting.
double cost_of(std::span<const BearingPair> pairs, const Eigen::Matrix3d& R,
               const Eigen::Vector3d& direction, double threshold) {
  double cost = 0.0;
  for (const BearingPair& pair : pairs) {
    const double ratio = epipolar_distance(pair, R, direction) / threshold;
    cost += std::min(ratio * ratio, 1.0);
  }
  return cost;
}

// Normal of the plane that the translation must lie in; zero without parallax.
Eigen::Vector3d plane_normal(const BearingPair& pair, const Eigen::Matrix3d& R) {
  return pair.previous.homogeneous().cross(R * pair.current.homogeneous());
}

}  // namespace

double epipolar_distance(const BearingPair& pair, const Eigen::Matrix3d& R,
                         const Eigen::Vector3d& t) {
  // b_prev^T [t]_x R b_cur = 0: the line in the current image is R^T (b_prev x t).
  const Eigen::Vector3d line = R.transpose() * pair.previous.homogeneous().cross(t);
  const double length = line.head<2>().norm();
  if (length < 1e-12) return 0.0;
  return std::abs(line.dot(pair.current.homogeneous())) / length;
}

TwoPointResult two_point_ransac(std::span<const BearingPair> pairs,
                                const Eigen::Matrix3d& R_previous_current, double threshold,
                                std::mt19937& rng) {
  TwoPointResult result;
  if (pairs.size() < 3) {
    result.inlier.assign(pairs.size(), true);
    result.inliers = static_cast<int>(pairs.size());
    return result;
  }
  std::uniform_int_distribution<std::size_t> any(0, pairs.size() - 1);
  double best = std::numeric_limits<double>::infinity();
  for (int sample = 0; sample < kTwoPointSamples; ++sample) {
    const std::size_t i = any(rng);
    const std::size_t j = any(rng);
    if (i == j) continue;
    const Eigen::Vector3d axis = plane_normal(pairs[i], R_previous_current)
                                     .cross(plane_normal(pairs[j], R_previous_current));
    // Parallel planes leave the direction open; without parallax any will do.
    const Eigen::Vector3d direction =
        axis.norm() > 1e-15 ? Eigen::Vector3d(axis.normalized()) : Eigen::Vector3d::UnitX();
    const double cost = cost_of(pairs, R_previous_current, direction, threshold);
    if (cost < best) {
      best = cost;
      result.direction = direction;
    }
  }
  result.inlier = inliers_of(pairs, R_previous_current, result.direction, threshold);
  for (const bool inlier : result.inlier) result.inliers += inlier ? 1 : 0;
  return result;
}

}  // namespace km
