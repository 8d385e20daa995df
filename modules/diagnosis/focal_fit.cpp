#include "modules/diagnosis/focal_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "modules/core/geometry/lie.hpp"
#include "modules/diagnosis/stereo_fit.hpp"

namespace km {
namespace {

constexpr double kFactorStep = 1e-4;  // step of the numeric derivative, and of convergence
constexpr double kSystematic_px = 0.01;

using Shared = Eigen::Matrix<double, 7, 1>;  // variables common to all steps: rotation of the
                                             // mounting, constant, factor
using SharedSquare = Eigen::Matrix<double, 7, 7>;

struct Step {
  Eigen::Vector3d rate;  // rate of the gyroscope, about its axes [rad/s]
  double seconds = 0.0;
  std::vector<TrackedPoint> points;                     // points with depth
  Eigen::Vector3d t_from_to = Eigen::Vector3d::Zero();  // [m]
};

// A tracked point in the left camera.
struct SeenPoint {
  Eigen::Vector3d from;        // bearing in the first image, z = 1
  double inverse_depth = 0.0;  // in the first image [1/m]
  Eigen::Vector2d to;          // bearing in the second image, z = 1
};

std::optional<SeenPoint> seen_by(const StereoRig& rig, const SE3& T_right_left,
                                 const TrackedPoint& point) {
  const auto to = rig.cameras[0].unproject(point.to);
  const auto seen = stereo_point(rig, T_right_left, {point.from, *point.right});
  if (!to || !seen || !(seen->depth_m > 0.0)) return std::nullopt;
  return SeenPoint{seen->left.homogeneous(), 1.0 / seen->depth_m, *to};
}

std::vector<Step> steps_of(std::span<const TrackedStep> tracked, const StereoRig& rig,
                           const GyroIntegral& gyro, double offset_s) {
  const SE3 T_right_left = rig.T_left_right().inverse();
  const Stamp offset = nanoseconds(offset_s);
  const auto has_depth = [&](const TrackedPoint& point) {
    if (!point.right) return false;
    const auto seen = stereo_point(rig, T_right_left, {point.from, *point.right});
    return seen && seen->error_px < kEpipolarInlier_px && seen->depth_m > 0.0;
  };
  constexpr std::size_t kLeastPoints = 30;
  std::vector<Step> steps;
  for (const TrackedStep& step : tracked) {
    const Stamp from = step.from + offset, to = step.to + offset;
    if (!gyro.covers(from, to)) continue;
    Step& added = steps.emplace_back();
    std::ranges::copy_if(step.points, std::back_inserter(added.points), has_depth);
    added.rate = gyro.mean(from, to);
    added.seconds = seconds_between(from, to);
    if (added.points.size() < kLeastPoints) steps.pop_back();
  }
  return steps;
}

// The normal equations of the shared variables, after elimination of each step's translation.
struct Normal {
  SharedSquare H = SharedSquare::Zero();
  Shared g = Shared::Zero();
  double weighted_squares = 0.0, weights = 0.0;  // [px^2]
  std::size_t points = 0;
};

struct StepNormal {
  Eigen::Matrix3d H = 1e-9 * Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 3, 7> H_shared = Eigen::Matrix<double, 3, 7>::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
};

class FocalProblem {
 public:
  FocalProblem(std::vector<Step> steps, const StereoRig& rig, const InertialFit& fit)
      : steps_(std::move(steps)), rig_(rig), Q_(fit.Q), constant_(fit.constant) {}

  // One step of Gauss-Newton; returns the change of the factor.
  double iterate(double scale_px) {
    const Rigs rigs(rig_, factor_);
    normal_ = {};
    std::vector<StepNormal> of_steps;
    of_steps.reserve(steps_.size());
    for (const Step& step : steps_) of_steps.push_back(linearize(step, rigs, scale_px));
    const Shared dx = -normal_.H.ldlt().solve(normal_.g);
    for (std::size_t k = 0; k < steps_.size(); ++k)
      steps_[k].t_from_to -= of_steps[k].H.inverse() * (of_steps[k].g + of_steps[k].H_shared * dx);
    Q_ = so3_exp(dx.head<3>()) * Q_;
    constant_ += dx.segment<3>(3);
    factor_ += dx[6];
    return std::abs(dx[6]);
  }

  [[nodiscard]] FocalFit result() const {
    const auto n = static_cast<double>(normal_.points);
    const double variance = normal_.weighted_squares / std::max(2.0 * normal_.weights, 1.0);
    const double inverse = normal_.H.ldlt().solve(Shared::Unit(6))[6];
    return {.steps = steps_.size(),
            .points = normal_.points,
            .factor = factor_,
            .sigma = std::sqrt(inverse * (variance + kSystematic_px * kSystematic_px * n)),
            .error_px = std::sqrt(2.0 * variance)};
  }

 private:
  // The rig with the focal lengths times `factor`, and times `factor` + kFactorStep.
  struct Rigs {
    Rigs(const StereoRig& rig, double factor)
        : now(scaled(rig, factor)), beyond(scaled(rig, factor + kFactorStep)) {}

    static StereoRig scaled(StereoRig rig, double factor) {
      for (Camera& camera : rig.cameras) camera.fx *= factor, camera.fy *= factor;
      return rig;
    }

    StereoRig now, beyond;
    SE3 T_right_left = now.T_left_right().inverse();
  };

  // Position of a point after the motion, in units of its depth before the motion.
  static Eigen::Vector3d moved(const SeenPoint& point, const Eigen::Matrix3d& R,
                               const Eigen::Vector3d& t) {
    return R.transpose() * (point.from - point.inverse_depth * t);
  }

  struct Linear {
    Eigen::Vector2d error;  // [px]
    Eigen::Matrix<double, 2, 7> J;
    Eigen::Matrix<double, 2, 3> J_t;
  };

  // Linearised error of a point; nullopt if the point is behind the camera in one of the images.
  [[nodiscard]] std::optional<Linear> linear(const TrackedPoint& tracked, const Step& step,
                                             const Eigen::Matrix3d& R, const Rigs& rigs) const {
    const auto point = seen_by(rigs.now, rigs.T_right_left, tracked);
    const auto beyond = seen_by(rigs.beyond, rigs.T_right_left, tracked);
    if (!point || !beyond) return std::nullopt;
    const Eigen::Vector3d m = moved(*point, R, step.t_from_to);
    const Eigen::Vector3d m_beyond = moved(*beyond, R, step.t_from_to);
    constexpr double kMinDepth = 0.05;  // relative to the depth before the motion
    if (!(m.z() > kMinDepth && m_beyond.z() > kMinDepth)) return std::nullopt;
    const double px = rigs.now.cameras[0].fx, px_beyond = rigs.beyond.cameras[0].fx;
    Eigen::Matrix<double, 2, 3> J_m;
    J_m << 1.0, 0.0, -m.x() / m.z(), 0.0, 1.0, -m.y() / m.z();
    J_m *= px / m.z();
    const Eigen::Matrix<double, 2, 3> J_rate = step.seconds * J_m * skew(m);
    Linear result;
    result.error = px * (m.hnormalized() - point->to);
    result.J << -J_rate * skew(Q_ * step.rate), J_rate,
        (px_beyond * (m_beyond.hnormalized() - beyond->to) - result.error) / kFactorStep;
    result.J_t = -point->inverse_depth * J_m * R.transpose();
    return result;
  }

  // Adds the equations of a step to normal_ after elimination of its translation.
  StepNormal linearize(const Step& step, const Rigs& rigs, double scale_px) {
    StepNormal own;
    const Eigen::Matrix3d R = so3_exp(Eigen::Vector3d(step.seconds * (Q_ * step.rate + constant_)));
    for (const TrackedPoint& tracked : step.points) {
      const auto point = linear(tracked, step, R, rigs);
      if (!point) continue;
      const auto& [e, J, J_t] = *point;
      const double s2 = scale_px * scale_px, w = std::pow(s2 / (s2 + e.squaredNorm()), 2);
      normal_.H += w * J.transpose() * J;
      normal_.g += w * J.transpose() * e;
      normal_.weighted_squares += w * e.squaredNorm();
      normal_.weights += w;
      ++normal_.points;
      own.H += w * J_t.transpose() * J_t;
      own.H_shared += w * J_t.transpose() * J;
      own.g += w * J_t.transpose() * e;
    }
    const Eigen::Matrix<double, 7, 3> gain = own.H_shared.transpose() * own.H.inverse();
    normal_.H -= gain * own.H_shared;
    normal_.g -= gain * own.g;
    return own;
  }

  std::vector<Step> steps_;
  const StereoRig rig_;
  Eigen::Matrix3d Q_;
  Eigen::Vector3d constant_;
  double factor_ = 1.0;
  Normal normal_;
};

}  // namespace

std::optional<FocalFit> fit_focal(std::span<const TrackedStep> tracked, const StereoRig& rig,
                                  std::span<const ImuSample> samples, const InertialFit& fit) {
  std::vector<Step> steps = steps_of(tracked, rig, GyroIntegral(samples), fit.offset_s);
  constexpr std::size_t kMinSteps = 20;
  if (steps.size() < kMinSteps) return std::nullopt;
  constexpr int kIterations = 20;
  constexpr double kFirstScale_px = 2.0, kLastScale_px = 0.5, kShrink = 0.7;
  FocalProblem problem(std::move(steps), rig, fit);
  double scale_px = kFirstScale_px;
  for (int k = 0; k < kIterations; ++k) {
    const double moved = problem.iterate(scale_px);
    if (!std::isfinite(moved)) return std::nullopt;
    if (scale_px == kLastScale_px && moved < kFactorStep) return problem.result();
    scale_px = std::max(kLastScale_px, kShrink * scale_px);
  }
  return std::nullopt;
}

}  // namespace km
