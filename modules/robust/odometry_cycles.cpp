#include "modules/robust/odometry_cycles.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

Matrix6 covariance_of_part(const Precision& precision, OdometryCycle::Component part,
                           int dimension) {
  Matrix6 Sigma = covariance_in(precision, dimension);
  const Eigen::Index other = part == OdometryCycle::kRotation ? 3 : 0;
  Sigma.block<3, 3>(other, other).setZero();
  return Sigma;
}

}  // namespace

Matrix6 covariance_in(const Precision& precision, int dimension) {
  Matrix6 Sigma = covariance_of(precision);
  if (dimension == 3) return Sigma;
  Sigma(0, 0) = Sigma(1, 1) = Sigma(5, 5) = 0.0;  // roll, pitch, z
  Sigma(2, 2) = 1.0 / precision.kappa;
  return Sigma;
}

MahalanobisLength mahalanobis_length(const Vector6& error, const Matrix6& Sigma, int dimension) {
  const auto length = [](const auto& e, const auto& block) {
    const Eigen::LLT<std::decay_t<decltype(block)>> factor(block);
    return MahalanobisLength{factor.matrixL().solve(e).squaredNorm(),
                             factor.matrixLLT().diagonal().array().log().sum()};
  };
  if (dimension == 3) return length(error, Sigma);
  const Eigen::Vector3d planar = error.segment<3>(2);
  const Eigen::Matrix3d block = Sigma.block<3, 3>(2, 2);
  return length(planar, block);
}

double log_density_if_true(const Vector6& error, const Matrix6& Sigma, int dimension) {
  const MahalanobisLength length = mahalanobis_length(error, Sigma, dimension);
  const double axes = dimension == 2 ? 3.0 : 6.0;
  return -0.5 * length.squared - length.log_root - 0.5 * axes * std::log(2.0 * std::numbers::pi);
}

Matrix6 TwoClosureCycle::covariance() const {
  return compose(compose(compose(up, above), down), below).Sigma;
}

Matrix6 TwoClosureCycle::covariance_of_odometry() const {
  return TwoClosureCycle{exact(up), above, exact(down), below}.covariance();
}

Matrix6 TwoClosureCycle::covariance_of_closures() const {
  return TwoClosureCycle{up, exact(above), down, exact(below)}.covariance();
}

OdometryChain::OdometryChain(std::span<const PoseEdge> steps, int dimension)
    : dimension_(dimension) {
  for (const PoseEdge& step : steps) {
    T_first_kf.push_back(T_first_kf.back() * step.T_from_to);
    const bool known = !is_unknown_step(step);
    run_.push_back(run_.back() + (known ? 0 : 1));
    const Matrix6 Ad = adjoint(T_first_kf.back());
    for (const auto part : {OdometryCycle::kRotation, OdometryCycle::kTranslation}) {
      Matrix6 Sigma = Matrix6::Zero();
      if (known) Sigma = covariance_of_part(step.precision, part, dimension);
      covariance_[part].push_back(covariance_[part].back() + Ad * Sigma * Ad.transpose());
    }
  }
}

// From the lower keyframe to the upper one.
UncertainPose OdometryChain::upward(const PoseEdge& closure, OdometryCycle::Component part) const {
  const UncertainPose measured{closure.T_from_to,
                               covariance_of_part(closure.precision, part, dimension_)};
  return closure.from < closure.to ? measured : inverse(measured);
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
  // The error is small, so the covariances of steps and closure may both be taken at the upper
  // keyframe.
  for (const auto part : {kRotation, kTranslation}) {
    const UncertainPose measured = upward(closure, part), chain = steps(lower, upper, part);
    cycle.error = se3_log(measured.T.inverse() * chain.T);
    cycle.covariance[part] = chain.Sigma;
    cycle.of_closures[part] = measured.Sigma;
    cycle.covariance[kClosure] += measured.Sigma;
  }
  return cycle;
}

OdometryCycle OdometryChain::close(const PoseEdge& one, const PoseEdge& other) const {
  using enum OdometryCycle::Component;
  const auto [lower, upper] = std::minmax(one.from.index, one.to.index);
  const auto [other_lower, other_upper] = std::minmax(other.from.index, other.to.index);
  OdometryCycle cycle{.closure = one, .other = other, .lower = lower, .upper = upper};
  for (const auto part : {kRotation, kTranslation}) {
    const TwoClosureCycle around{upward(one, part), steps(upper, other_upper, part),
                                 inverse(upward(other, part)), steps(other_lower, lower, part)};
    cycle.error = se3_log(around.T());
    cycle.covariance[part] = around.covariance_of_odometry();
    cycle.of_closures[part] = around.covariance_of_closures();
    cycle.covariance[kTwoClosures] += cycle.of_closures[part];
  }
  return cycle;
}

}  // namespace km
