#include "modules/diagnosis/image_rotation.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "modules/core/geometry/lie.hpp"
#include "modules/diagnosis/stereo_fit.hpp"
#include "modules/vio/track_motion.hpp"

namespace km {
namespace {

constexpr std::size_t kMinBearings = 20;
constexpr double kMinShare = 0.5;
constexpr double kGate = 3.0;         // largest distance of an inlier, in sigmas
constexpr double kFirstScale = 20.0;  // initial scale of the robust weight, in sigmas
constexpr int kIterations = 15;

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

struct EpipolarState {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::UnitX();
};

double weight_of(double residual, double scale) {
  const double ratio = residual / scale;
  const double w = 1.0 / (1.0 + ratio * ratio);
  return w * w;
}

// Sampson distance on z = 1, and the divisor that converts the constraint to this distance.
struct Sampson {
  double distance = 0.0, gradient = 1.0;
};

Sampson sampson(const EpipolarState& state, const BearingStep& step) {
  const Eigen::Matrix3d E = skew(state.t) * state.R;
  const Eigen::Vector3d line_from = E * step.to.homogeneous();
  const Eigen::Vector3d line_to = E.transpose() * step.from.homogeneous();
  const double gradient =
      std::sqrt(line_from.head<2>().squaredNorm() + line_to.head<2>().squaredNorm());
  if (gradient < 1e-9) return {};
  return {step.from.homogeneous().dot(line_from) / gradient, gradient};
}

// Rotation that aligns `to` with `from` without translation.
Eigen::Matrix3d rotation_alone(std::span<const BearingStep> steps, double sigma) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  double scale = kFirstScale * sigma;
  for (int k = 0; k < kIterations; ++k, scale = std::max(scale * 0.8, kGate * sigma)) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const BearingStep& step : steps) {
      const Eigen::Vector3d from = step.from.homogeneous().normalized();
      const Eigen::Vector3d turned = R * step.to.homogeneous().normalized();
      const Eigen::Vector3d residual = turned - from;
      const Eigen::Matrix3d J = -skew(turned);  // derivative by x in exp(x) R
      const double w = weight_of(residual.norm(), scale);
      H += w * J.transpose() * J;
      g += w * J.transpose() * residual;
    }
    R = so3_exp(-H.ldlt().solve(g)) * R;
  }
  return R;
}

// Direction t that satisfies t . (R to x from) = 0 best over all points.
Eigen::Vector3d best_direction(std::span<const BearingStep> steps, const Eigen::Matrix3d& R) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const BearingStep& step : steps) {
    const Eigen::Vector3d normal =
        (R * step.to.homogeneous().normalized()).cross(step.from.homogeneous().normalized());
    M += normal * normal.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(M).eigenvectors().col(0);
}

// Two directions orthogonal to t.
Eigen::Matrix<double, 3, 2> tangents(const Eigen::Vector3d& t) {
  const Eigen::Vector3d a = t.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> basis;
  basis << a, t.cross(a);
  return basis;
}

EpipolarState refined(std::span<const BearingStep> steps, EpipolarState state, double sigma) {
  double scale = kFirstScale * sigma;
  for (int k = 0; k < kIterations; ++k, scale = std::max(scale * 0.7, kGate * sigma)) {
    Matrix5 H = Matrix5::Identity() * 1e-9;
    Vector5 g = Vector5::Zero();
    const Eigen::Matrix<double, 3, 2> basis = tangents(state.t);
    for (const BearingStep& step : steps) {
      const Sampson found = sampson(state, step);
      const Eigen::Vector3d from = step.from.homogeneous();
      const Eigen::Vector3d turned = state.R * step.to.homogeneous();
      // from . (t x exp(x) turned), derivatives by x and by t.
      Vector5 J;
      J << turned.cross(from.cross(state.t)), basis.transpose() * turned.cross(from);
      J /= found.gradient;
      const double w = weight_of(found.distance, scale);
      H += w * J * J.transpose();
      g += w * J * found.distance;
    }
    const Vector5 x = -H.ldlt().solve(g);
    state.R = so3_exp(x.head<3>()) * state.R;
    state.t = (state.t + basis * x.tail<2>()).normalized();
  }
  return state;
}

double robust_cost(std::span<const BearingStep> steps, const EpipolarState& state, double sigma) {
  double cost = 0.0;
  for (const BearingStep& step : steps) {
    const double ratio = sampson(state, step).distance / (kGate * sigma);
    cost += ratio * ratio / (1.0 + ratio * ratio);
  }
  return cost;
}

constexpr double kNoise_px = 0.3;  // noise of a tracked corner
constexpr std::size_t kMinDepths = 30;

std::vector<BearingStep> bearings_of(const TrackedStep& step, const Camera& camera) {
  std::vector<BearingStep> bearings;
  for (const TrackedPoint& point : step.points) {
    const auto from = camera.unproject(point.from), to = camera.unproject(point.to);
    if (from && to) bearings.push_back({*from, *to});
  }
  return bearings;
}

std::vector<DepthPair> depths_of(const TrackedStep& step, const StereoRig& rig) {
  std::vector<DepthPair> pairs;
  const SE3 T_right_left = rig.T_left_right().inverse();
  for (const TrackedPoint& point : step.points) {
    const auto to = rig.cameras[0].unproject(point.to);
    const auto from = rig.cameras[0].unproject(point.from);
    if (!point.right) {
      if (point.depth_m > 0.0 && from && to) pairs.push_back({*from, 1.0 / point.depth_m, *to});
      continue;
    }
    const auto seen = stereo_point(rig, T_right_left, {point.from, *point.right});
    if (to && seen && seen->error_px < kEpipolarInlier_px && seen->depth_m > 0.0)
      pairs.push_back({seen->left, 1.0 / seen->depth_m, *to});
  }
  return pairs;
}

}  // namespace

std::optional<ImageRotation> rotation_between(std::span<const BearingStep> steps, double sigma) {
  if (steps.size() < kMinBearings) return std::nullopt;
  EpipolarState best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& R :
       {rotation_alone(steps, sigma), Eigen::Matrix3d(Eigen::Matrix3d::Identity())}) {
    const EpipolarState state = refined(steps, {R, best_direction(steps, R)}, sigma);
    const double cost = robust_cost(steps, state, sigma);
    if (cost < least) best = state;
    least = std::min(least, cost);
  }
  const auto inliers = std::ranges::count_if(steps, [&](const BearingStep& step) {
    return std::abs(sampson(best, step).distance) < kGate * sigma;
  });
  const double share = static_cast<double>(inliers) / static_cast<double>(steps.size());
  if (share < kMinShare || !best.R.allFinite()) return std::nullopt;
  return ImageRotation{so3_log(best.R), share};
}

VisualRotations visual_rotations(std::span<const TrackedStep> steps, const StereoRig& rig,
                                 bool use_depth) {
  const Camera& camera = rig.cameras[0];
  const double sigma = kNoise_px / camera.fx;
  std::mt19937 rng(1);
  VisualRotations seen;
  for (const TrackedStep& step : steps) {
    const auto alone = rotation_between(bearings_of(step, camera), sigma);
    if (!alone) continue;
    VisualRotation found{step.from, step.to, alone->rotation, {}};
    const std::vector<DepthPair> depths =
        use_depth ? depths_of(step, rig) : std::vector<DepthPair>();
    if (depths.size() >= kMinDepths) {
      SE3 guess = SE3::Identity();
      guess.linear() = so3_exp(alone->rotation);
      const auto motion = estimate_motion(depths, guess, sigma, rng);
      if (!motion) continue;
      found.rotation = so3_log(motion->linear());
      found.translation = motion->translation();
      ++seen.with_depth;
    }
    seen.steps.push_back(found);
  }
  return seen;
}

}  // namespace km
