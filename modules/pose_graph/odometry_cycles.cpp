#include "modules/pose_graph/odometry_cycles.hpp"

#include <algorithm>

#include "modules/core/lie.hpp"

namespace km {
namespace {

UncertainPose exact(UncertainPose pose) {
  pose.Sigma.setZero();
  return pose;
}

// From the lower keyframe to the upper one.
UncertainPose upward(const PoseEdge& closure) {
  const UncertainPose measured{closure.T_from_to, covariance_of(closure.precision)};
  return closure.from < closure.to ? measured : inverse(measured);
}

}  // namespace

Matrix6 TwoClosureCycle::covariance() const {
  return compose(compose(compose(up, above), down), below).Sigma;
}

Matrix6 TwoClosureCycle::covariance_of_odometry() const {
  return TwoClosureCycle{exact(up), above, exact(down), below}.covariance();
}

Matrix6 TwoClosureCycle::covariance_of_closures() const {
  return TwoClosureCycle{up, exact(above), down, exact(below)}.covariance();
}

OdometryChain::OdometryChain(std::span<const PoseEdge> steps) {
  for (const PoseEdge& step : steps) {
    T_first_kf.push_back(T_first_kf.back() * step.T_from_to);
    const Matrix6 Ad = adjoint(T_first_kf.back());
    const Matrix6 claimed = covariance_of(step.precision);
    for (const auto part : {OdometryCycle::kRotation, OdometryCycle::kTranslation}) {
      Matrix6 Sigma = Matrix6::Zero();
      const Eigen::Index begin = part == OdometryCycle::kRotation ? 0 : 3;
      Sigma.block<3, 3>(begin, begin) = claimed.block<3, 3>(begin, begin);
      covariance_[part].push_back(covariance_[part].back() + Ad * Sigma * Ad.transpose());
    }
  }
}

// The covariance is that of one source of noise, at the end of the steps.
UncertainPose OdometryChain::steps(std::size_t from, std::size_t to,
                                   OdometryCycle::Component part) const {
  const SE3 T_from_to = T_first_kf[from].inverse() * T_first_kf[to];
  if (from > to) return inverse(steps(to, from, part));
  const Matrix6 Ad = adjoint(T_first_kf[to].inverse());
  return {T_from_to, Ad * (covariance_[part][to] - covariance_[part][from]) * Ad.transpose()};
}

OdometryCycle OdometryChain::close(const PoseEdge& closure) const {
  using enum OdometryCycle::Component;
  const auto [lower, upper] = std::minmax(closure.from.index, closure.to.index);
  OdometryCycle cycle{.closure = closure, .lower = lower, .upper = upper};
  const UncertainPose measured = upward(closure);
  // The error is small, so the covariances of steps and closure may both be taken at the upper
  // keyframe.
  cycle.error = se3_log(measured.T.inverse() * steps(lower, upper, kRotation).T);
  for (const auto part : {kRotation, kTranslation})
    cycle.covariance[part] = steps(lower, upper, part).Sigma;
  cycle.covariance[kClosure] = measured.Sigma;
  return cycle;
}

OdometryCycle OdometryChain::close(const PoseEdge& one, const PoseEdge& other) const {
  using enum OdometryCycle::Component;
  const auto [lower, upper] = std::minmax(one.from.index, one.to.index);
  const auto [other_lower, other_upper] = std::minmax(other.from.index, other.to.index);
  OdometryCycle cycle{.closure = one, .other = other, .lower = lower, .upper = upper};
  for (const auto part : {kRotation, kTranslation}) {
    const TwoClosureCycle around{upward(one), steps(upper, other_upper, part),
                                 inverse(upward(other)), steps(other_lower, lower, part)};
    cycle.error = se3_log(around.T());
    cycle.covariance[part] = around.covariance_of_odometry();
    cycle.covariance[kTwoClosures] = around.covariance_of_closures();
  }
  return cycle;
}

}  // namespace km
