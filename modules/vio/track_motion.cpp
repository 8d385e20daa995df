#include "modules/vio/track_motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

constexpr int kSamples = 48;
// Without a gyroscope: samples, steps for each, and the scale of a loss that weighs nothing down.
constexpr int kFreeSamples = 48;
constexpr int kFreeSteps = 5;
constexpr double kNoLoss = 1e3;
constexpr double kCoarseSigmas = 6.0;  // Truncation of the cost before the rotation is refined.

// Truncated quadratic cost (MSAC) of the distances of all pairs.
template <typename Pair, typename Distance>
double cost_of(std::span<const Pair> pairs, double threshold, const Distance& distance) {
  double cost = 0.0;
  for (const Pair& pair : pairs) {
    const double ratio = distance(pair) / threshold;
    cost += std::min(ratio * ratio, 1.0);
  }
  return cost;
}

// Two rows of A s = b for s = R^T t: the transferred landmark, c - rho s with c = R^T [b_prev; 1],
// must be parallel to the current bearing.
void add_rows(const DepthPair& pair, const Eigen::Matrix3d& R, Eigen::Matrix3d& H,
              Eigen::Vector3d& g) {
  const Eigen::Vector3d c = R.transpose() * pair.previous.homogeneous();
  for (int axis = 0; axis < 2; ++axis) {
    Eigen::Vector3d row = Eigen::Vector3d::Zero();
    row[axis] = pair.inverse_depth;
    row.z() = -pair.current[axis] * pair.inverse_depth;
    H += row * row.transpose();
    g += row * (c[axis] - pair.current[axis] * c.z());
  }
}

// Translation from two landmarks under a known rotation; nullopt if they are too far away.
std::optional<Eigen::Vector3d> translation_of(const DepthPair& a, const DepthPair& b,
                                              const Eigen::Matrix3d& R) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  add_rows(a, R, H, g);
  add_rows(b, R, H, g);
  Eigen::Matrix3d inverse;
  bool invertible = false;
  H.computeInverseWithCheck(inverse, invertible, 1e-12);
  if (!invertible) return std::nullopt;
  const Eigen::Vector3d t = R * (inverse * g);
  return t.allFinite() ? std::optional(t) : std::nullopt;
}

// One Gauss-Newton step over T * exp(xi) with Geman-McClure weights of scale `scale`.
SE3 refined(std::span<const DepthPair> pairs, const SE3& T, double scale) {
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  for (const DepthPair& pair : pairs) {
    const Eigen::Vector3d X = transfer(pair, T);
    if (X.z() <= 0.0) continue;
    const Eigen::Vector2d error = X.head<2>() / X.z() - pair.current;
    const double w = 1.0 / (1.0 + error.squaredNorm() / (scale * scale));
    // X = R^T (b - rho t): dX = [X]_x dphi - rho dt for T * exp([dphi; dt]).
    Eigen::Matrix<double, 2, 3> J_X;
    J_X << 1.0 / X.z(), 0.0, -X.x() / (X.z() * X.z()),  //
        0.0, 1.0 / X.z(), -X.y() / (X.z() * X.z());
    Eigen::Matrix<double, 2, 6> J;
    J << J_X * skew(X), -pair.inverse_depth * J_X;
    H.noalias() += w * w * J.transpose() * J;
    g.noalias() -= w * w * J.transpose() * error;
  }
  // Damping for directions that the landmarks do not determine, for instance if all are far away.
  H.diagonal().array() += 1e-6;
  return T * se3_exp(H.ldlt().solve(g));
}

// The best of some motions by a truncated cost, refined.
class MotionSearch {
 public:
  MotionSearch(std::span<const DepthPair> pairs, const SE3& guess, double sigma)
      : pairs_(pairs), sigma_(sigma), best_(guess), best_cost_(coarse_cost(guess)) {}

  void consider(const SE3& T) {
    const double cost = coarse_cost(T);
    if (!(cost < best_cost_)) return;
    best_cost_ = cost;
    best_ = T;
  }

  // The best motion, refined; nullopt if fewer than half of the landmarks agree with it.
  [[nodiscard]] std::optional<SE3> result() const {
    SE3 best = best_;
    for (double scale = kCoarseSigmas * sigma_; scale >= sigma_; scale *= 0.7)
      best = refined(pairs_, best, scale);
    if (!best.matrix().allFinite()) return std::nullopt;
    best.linear() = nearest_rotation(best.linear());

    constexpr double kAgreeSigmas = 3.0;
    const auto agreeing = std::count_if(pairs_.begin(), pairs_.end(), [&](const DepthPair& pair) {
      return reprojection_distance(pair, best) < kAgreeSigmas * sigma_;
    });
    if (2 * static_cast<std::size_t>(agreeing) < pairs_.size()) return std::nullopt;
    return best;
  }

 private:
  [[nodiscard]] double coarse_cost(const SE3& T) const {
    return cost_of(pairs_, kCoarseSigmas * sigma_,
                   [&](const DepthPair& pair) { return reprojection_distance(pair, T); });
  }

  std::span<const DepthPair> pairs_;
  double sigma_;
  SE3 best_;
  double best_cost_;
};

// Normal of the pair's epipolar plane, which contains the translation; zero without parallax.
Eigen::Vector3d plane_normal(const BearingPair& pair, const Eigen::Matrix3d& R) {
  return pair.previous.homogeneous().cross(R * pair.current.homogeneous());
}

}  // namespace

Eigen::Vector3d transfer(const DepthPair& pair, const SE3& T_previous_current) {
  return T_previous_current.linear().transpose() *
         (pair.previous.homogeneous() - pair.inverse_depth * T_previous_current.translation());
}

double reprojection_distance(const DepthPair& pair, const SE3& T_previous_current) {
  const Eigen::Vector3d X = transfer(pair, T_previous_current);
  if (!(X.z() > 0.0)) return std::numeric_limits<double>::infinity();
  return (X.head<2>() / X.z() - pair.current).norm();
}

std::optional<SE3> estimate_motion(std::span<const DepthPair> pairs, const SE3& guess, double sigma,
                                   std::mt19937& rng) {
  if (pairs.size() < kMinMotionPairs) return std::nullopt;
  MotionSearch search(pairs, guess, sigma);
  std::uniform_int_distribution<std::size_t> any(0, pairs.size() - 1);
  for (int sample = 0; sample < kSamples; ++sample) {
    const std::size_t i = any(rng);
    const std::size_t j = any(rng);
    if (i == j) continue;
    const std::optional<Eigen::Vector3d> t = translation_of(pairs[i], pairs[j], guess.linear());
    if (t) search.consider(make_pose(guess.linear(), *t));
  }
  return search.result();
}

std::optional<SE3> estimate_free_motion(std::span<const DepthPair> pairs, const SE3& guess,
                                        double sigma, std::mt19937& rng) {
  if (pairs.size() < kMinMotionPairs) return std::nullopt;
  MotionSearch search(pairs, guess, sigma);
  std::uniform_int_distribution<std::size_t> any(0, pairs.size() - 1);
  for (int sample = 0; sample < kFreeSamples; ++sample) {
    const std::size_t i = any(rng);
    const std::size_t j = any(rng);
    const std::size_t k = any(rng);
    if (i == j || j == k || i == k) continue;
    const std::array<DepthPair, 3> chosen = {pairs[i], pairs[j], pairs[k]};
    SE3 T = guess;
    for (int step = 0; step < kFreeSteps; ++step) T = refined(chosen, T, kNoLoss);
    if (T.matrix().allFinite()) search.consider(T);
  }
  return search.result();
}

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
    // Parallel planes leave the direction undetermined; without parallax any direction fits.
    const Eigen::Vector3d direction =
        axis.norm() > 1e-15 ? Eigen::Vector3d(axis.normalized()) : Eigen::Vector3d::UnitX();
    const double cost = cost_of(pairs, threshold, [&](const BearingPair& pair) {
      return epipolar_distance(pair, R_previous_current, direction);
    });
    if (cost < best) {
      best = cost;
      result.direction = direction;
    }
  }
  for (const BearingPair& pair : pairs) {
    result.inlier.push_back(epipolar_distance(pair, R_previous_current, result.direction) <
                            threshold);
    result.inliers += result.inlier.back() ? 1 : 0;
  }
  return result;
}

}  // namespace km
