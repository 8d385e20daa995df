#include "odometry_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "modules/core/lie.hpp"

namespace km {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

void add_relative_errors(std::span<const OdometryState> states, std::span<const SE3> truth,
                         OdometryErrors& errors) {
  double squared_m = 0.0, squared_rad = 0.0;
  int pairs = 0;
  for (std::size_t i = 0; i < states.size(); ++i)
    for (std::size_t j = i + 1; j < states.size(); ++j) {
      if (std::abs(seconds_between(states[i].stamp, states[j].stamp) - 1.0) > 0.02) continue;
      const SE3 error = (truth[i].inverse() * truth[j]).inverse() *
                        (states[i].T_odom_body.inverse() * states[j].T_odom_body);
      squared_m += error.translation().squaredNorm();
      squared_rad += std::pow(angle_of(error.linear()), 2);
      ++pairs;
    }
  if (pairs == 0) return;
  errors.rpe_m = std::sqrt(squared_m / pairs);
  errors.rpe_deg = kDegrees * std::sqrt(squared_rad / pairs);
}

}  // namespace

OdometryErrors odometry_errors(std::span<const OdometryState> states, std::span<const SE3> truth) {
  OdometryErrors errors;
  const double n = static_cast<double>(states.size());
  Eigen::Vector3d mean_odom = Eigen::Vector3d::Zero(), mean_world = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < states.size(); ++k) {
    mean_odom += states[k].T_odom_body.translation() / n;
    mean_world += truth[k].translation() / n;
  }
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  double squared_odom = 0.0;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const Eigen::Vector3d a = states[k].T_odom_body.translation() - mean_odom;
    C += (truth[k].translation() - mean_world) * a.transpose();
    squared_odom += a.squaredNorm();
  }
  const Eigen::Matrix3d R_world_odom = nearest_rotation(C);
  double squared = 0.0, tilt = 0.0, product = 0.0;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const SE3& T = states[k].T_odom_body;
    const Eigen::Vector3d a = R_world_odom * (T.translation() - mean_odom);
    const Eigen::Vector3d b = truth[k].translation() - mean_world;
    product += a.dot(b);
    errors.max_m = std::max(errors.max_m, (a - b).norm());
    squared += (a - b).squaredNorm() / n;
    const double cosine = T.linear().row(2).dot(truth[k].linear().row(2));
    tilt += std::pow(std::acos(std::clamp(cosine, -1.0, 1.0)), 2) / n;
  }
  errors.ate_m = std::sqrt(squared);
  errors.scale = product / squared_odom;
  errors.tilt_deg = kDegrees * std::sqrt(tilt);
  add_relative_errors(states, truth, errors);
  return errors;
}

}  // namespace km
