#include "modules/pose_graph/frame_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "modules/core/lie.hpp"

namespace km {
namespace {

constexpr int kMaxRefinements = 20;

// Squared distance in units of the tolerance.
double distance(const SE3& a, const SE3& b) {
  // ||R_1 - R_2||_F = 2 sqrt(2) sin(angle / 2).
  static const double kLargestChordal = 2.0 * std::sqrt(2.0) * std::sin(0.5 * kAlignedRotation_rad);
  const double rotation = (a.linear() - b.linear()).norm() / kLargestChordal;
  const double translation = (a.translation() - b.translation()).norm() / kAlignedTranslation_m;
  const double d = std::max(rotation, translation);
  return d * d;
}

std::vector<std::size_t> inliers_of(const SE3& T, std::span<const SE3> candidates) {
  std::vector<std::size_t> inliers;
  for (std::size_t k = 0; k < candidates.size(); ++k)
    if (distance(T, candidates[k]) <= 1.0) inliers.push_back(k);
  return inliers;
}

SE3 average(std::span<const SE3> candidates, const std::vector<std::size_t>& inliers) {
  Eigen::Matrix<double, 3, 4> mean = Eigen::Matrix<double, 3, 4>::Zero();
  for (const std::size_t k : inliers) mean += candidates[k].matrix().topRows<3>();
  mean /= static_cast<double>(inliers.size());
  return make_pose(nearest_stiefel(mean.leftCols<3>()), mean.col(3));
}

}  // namespace

std::optional<FrameAlignment> align_frames(std::span<const SE3> candidates,
                                           const std::vector<double>& given_weights) {
  if (candidates.empty()) return std::nullopt;
  std::vector<double> weights = given_weights;
  if (weights.empty()) weights.resize(candidates.size(), 1.0);
  if (weights.size() != candidates.size() ||
      !std::ranges::all_of(weights, [](double w) { return w > 0.0; }))
    throw std::invalid_argument("align_frames: not a positive weight for each candidate");
  std::size_t best = 0;
  double best_cost = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    double cost = 0.0;
    for (std::size_t other = 0; other < candidates.size(); ++other)
      cost += weights[other] * std::min(1.0, distance(candidates[k], candidates[other]));
    if (cost < best_cost) {
      best_cost = cost;
      best = k;
    }
  }
  FrameAlignment result{candidates[best], inliers_of(candidates[best], candidates)};
  for (int i = 0; i < kMaxRefinements; ++i) {
    const SE3 T = average(candidates, result.inliers);
    auto inliers = inliers_of(T, candidates);
    if (inliers.empty()) break;  // candidates on a ring are far from their average
    const bool settled = inliers == result.inliers;
    result = {T, std::move(inliers)};
    if (settled) break;
  }
  return result;
}

}  // namespace km
