#include "modules/pose_graph/frame_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "modules/pose_graph/stiefel.hpp"

namespace km {
namespace {

constexpr int kMaxRefinements = 20;

// Squared distance in units of the tolerance.
class Distance {
 public:
  explicit Distance(const AlignmentTolerance& tolerance)
      // ||R_1 - R_2||_F = 2 sqrt(2) sin(angle / 2).
      : max_chordal_(2.0 * std::sqrt(2.0) * std::sin(0.5 * tolerance.rotation_rad)),
        max_translation_(tolerance.translation_m) {}

  double operator()(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const {
    const double rotation = (a.leftCols<3>() - b.leftCols<3>()).norm() / max_chordal_;
    const double translation = (a.col(3) - b.col(3)).norm() / max_translation_;
    const double d = std::max(rotation, translation);
    return d * d;
  }

 private:
  double max_chordal_;
  double max_translation_;
};

void check(std::span<const Eigen::MatrixXd> candidates, const AlignmentTolerance& tolerance) {
  if (!(tolerance.rotation_rad > 0.0 && tolerance.translation_m > 0.0))
    throw std::invalid_argument("align_frames: a tolerance is not positive");
  for (const Eigen::MatrixXd& candidate : candidates)
    if (candidate.cols() != 4 || candidate.rows() != candidates.front().rows() ||
        candidate.rows() < 3)
      throw std::invalid_argument("align_frames: candidates are not all r x 4 with r >= 3");
}

std::vector<std::size_t> inliers_of(const Eigen::MatrixXd& L,
                                    std::span<const Eigen::MatrixXd> candidates,
                                    const Distance& distance) {
  std::vector<std::size_t> inliers;
  for (std::size_t k = 0; k < candidates.size(); ++k)
    if (distance(L, candidates[k]) <= 1.0) inliers.push_back(k);
  return inliers;
}

Eigen::MatrixXd average(std::span<const Eigen::MatrixXd> candidates,
                        const std::vector<std::size_t>& inliers) {
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(candidates.front().rows(), 4);
  for (const std::size_t k : inliers) mean += candidates[k];
  mean /= static_cast<double>(inliers.size());
  mean.leftCols<3>() = nearest_stiefel(mean.leftCols<3>());
  return mean;
}

}  // namespace

std::optional<FrameAlignment> align_frames(std::span<const Eigen::MatrixXd> candidates,
                                           const AlignmentTolerance& tolerance,
                                           const std::vector<double>& given_weights) {
  check(candidates, tolerance);
  if (candidates.empty()) return std::nullopt;
  std::vector<double> weights = given_weights;
  if (weights.empty()) weights.resize(candidates.size(), 1.0);
  if (weights.size() != candidates.size() ||
      !std::ranges::all_of(weights, [](double w) { return w > 0.0; }))
    throw std::invalid_argument("align_frames: not a positive weight for each candidate");
  const Distance distance(tolerance);
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
  FrameAlignment result{candidates[best], inliers_of(candidates[best], candidates, distance)};
  for (int i = 0; i < kMaxRefinements; ++i) {
    Eigen::MatrixXd L = average(candidates, result.inliers);
    auto inliers = inliers_of(L, candidates, distance);
    if (inliers.empty()) break;  // the average of a ring can lie outside of it
    const bool settled = inliers == result.inliers;
    result = {std::move(L), std::move(inliers)};
    if (settled) break;
  }
  return result;
}

}  // namespace km
