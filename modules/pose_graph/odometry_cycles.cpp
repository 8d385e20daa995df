#include "modules/pose_graph/odometry_cycles.hpp"

#include "modules/core/lie.hpp"

namespace km {

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

OdometryCycle OdometryChain::close(const PoseEdge& closure) const {
  const bool is_up = closure.from < closure.to;
  const std::size_t i = (is_up ? closure.from : closure.to).index;
  const std::size_t j = (is_up ? closure.to : closure.from).index;
  const SE3 measured = is_up ? closure.T_from_to : closure.T_from_to.inverse();
  const Matrix6 Ad = adjoint(T_first_kf[j].inverse());
  OdometryCycle cycle{.closure = closure, .lower = i, .upper = j};
  // The error is small, so that both covariances refer to j.
  cycle.error = se3_log(measured.inverse() * T_first_kf[i].inverse() * T_first_kf[j]);
  for (const auto part : {OdometryCycle::kRotation, OdometryCycle::kTranslation})
    cycle.covariance[part] = Ad * (covariance_[part][j] - covariance_[part][i]) * Ad.transpose();
  cycle.covariance[OdometryCycle::kClosure] = covariance_of(closure.precision);
  if (!is_up) {
    const Matrix6 Ad_closure = adjoint(closure.T_from_to);
    Matrix6& Sigma = cycle.covariance[OdometryCycle::kClosure];
    Sigma = Ad_closure * Sigma * Ad_closure.transpose();
  }
  return cycle;
}

}  // namespace km
