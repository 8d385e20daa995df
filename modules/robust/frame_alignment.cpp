#include "modules/robust/frame_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

constexpr int kMaxRefinements = 20;
// Share of the weight of the first inliers that a candidate must keep after a halving of the
// tolerance.
constexpr double kLeastWeightKept = 0.5;
constexpr int kMaxHalvings = 20;

// Squared distance in units of the tolerance.
double distance(const SE3& a, const SE3& b) {
  // ||R_1 - R_2||_F = 2 sqrt(2) sin(angle / 2).
  static const double kLargestChordal = 2.0 * std::sqrt(2.0) * std::sin(0.5 * kAlignedRotation_rad);
  const double rotation = (a.linear() - b.linear()).norm() / kLargestChordal;
  const double translation = (a.translation() - b.translation()).norm() / kAlignedTranslation_m;
  const double d = std::max(rotation, translation);
  return d * d;
}

// `among`, as far as they are within `limit` of T.
std::vector<std::size_t> inliers_of(const SE3& T, std::span<const SE3> candidates,
                                    std::span<const std::size_t> among, double limit) {
  std::vector<std::size_t> inliers;
  for (const std::size_t k : among)
    if (distance(T, candidates[k]) <= limit) inliers.push_back(k);
  return inliers;
}

// The candidate among these with the least truncated sum of squares, for the squared tolerance
// `limit`.
std::size_t best_of(std::span<const SE3> candidates, std::span<const double> weights,
                    std::span<const std::size_t> among, double limit) {
  std::size_t best = among.front();
  double best_cost = std::numeric_limits<double>::infinity();
  for (const std::size_t k : among) {
    double cost = 0.0;
    for (const std::size_t other : among)
      cost += weights[other] * std::min(limit, distance(candidates[k], candidates[other]));
    if (cost < best_cost) {
      best_cost = cost;
      best = k;
    }
  }
  return best;
}

double sum_of(std::span<const double> weights, std::span<const std::size_t> among) {
  double sum = 0.0;
  for (const std::size_t k : among) sum += weights[k];
  return sum;
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
  std::vector<std::size_t> all(candidates.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  double limit = 1.0;  // squared tolerance
  std::size_t best = best_of(candidates, weights, all, limit);
  std::vector<std::size_t> inliers = inliers_of(candidates[best], candidates, all, limit);
  const double least = kLeastWeightKept * sum_of(weights, inliers);
  for (int i = 0; i < kMaxHalvings; ++i) {
    const double smaller = 0.25 * limit;
    const std::size_t next = best_of(candidates, weights, inliers, smaller);
    auto left = inliers_of(candidates[next], candidates, inliers, smaller);
    if (sum_of(weights, left) < least) break;
    limit = smaller;
    best = next;
    inliers = std::move(left);
  }
  FrameAlignment result{candidates[best], std::move(inliers)};
  for (int i = 0; i < kMaxRefinements; ++i) {
    const SE3 T = average(candidates, result.inliers);
    auto within = inliers_of(T, candidates, all, limit);
    if (within.empty()) break;  // candidates on a ring are far from their average
    const bool settled = within == result.inliers;
    result = {T, std::move(within)};
    if (settled) break;
  }
  return result;
}

}  // namespace km
