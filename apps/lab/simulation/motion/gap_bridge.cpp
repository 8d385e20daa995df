#include "apps/lab/simulation/motion/gap_bridge.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>

#include "modules/core/lie.hpp"

namespace km {
namespace {

constexpr Stamp kGap = 60'000'000;      // ns; recordings at 20 Hz have none
constexpr Stamp kMargin = 250'000'000;  // ns
constexpr double kMaxImuStep_s = 0.05;
// Assumed errors of the recorded poses, and standard deviations of the biases. The weights only
// keep biases small that the margins do not determine.
constexpr double kRotationNoise_rad = 2e-3, kGyroBias_radps = 0.05;
constexpr double kPositionNoise_m = 1e-3, kAccelBias_mps2 = 0.3;

// Motion since the first inertial sample, and its derivatives by the biases.
struct Reckoned {
  Stamp stamp = 0;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d integral = Eigen::Matrix3d::Zero();         // integral of R
  Eigen::Matrix3d double_integral = Eigen::Matrix3d::Zero();  // double integral of R
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

using Reckoning = std::vector<Reckoned>;  // one entry per inertial sample

Reckoning rotations(std::span<const ImuSample> imu, const Eigen::Matrix3d& start) {
  Reckoning states{{.stamp = imu.front().stamp, .R = start}};
  for (std::size_t k = 1; k < imu.size(); ++k) {
    const double dt = seconds_between(imu[k - 1].stamp, imu[k].stamp);
    Reckoned next = states.back();
    next.stamp = imu[k].stamp;
    next.R = next.R * so3_exp(0.5 * dt * (imu[k - 1].gyro + imu[k].gyro));
    next.integral += 0.5 * dt * (states.back().R + next.R);
    states.push_back(next);
  }
  return states;
}

// Integrates velocities and positions with the current rotations. The acceleration of a step is the
// mean over its two ends.
void integrate_positions(Reckoning& states, std::span<const ImuSample> imu, double gravity_mps2) {
  const Eigen::Vector3d g(0.0, 0.0, -gravity_mps2);
  for (std::size_t k = 1; k < states.size(); ++k) {
    const Reckoned& last = states[k - 1];
    Reckoned& next = states[k];
    const double dt = seconds_between(last.stamp, next.stamp);
    const Eigen::Vector3d a = 0.5 * (last.R * imu[k - 1].accel + next.R * imu[k].accel) + g;
    next.integral = last.integral + 0.5 * dt * (last.R + next.R);
    next.double_integral = last.double_integral + 0.5 * dt * (last.integral + next.integral);
    next.velocity = last.velocity + dt * a;
    next.position = last.position + dt * last.velocity + 0.5 * dt * dt * a;
  }
}

// Interpolates between two inertial samples; `stamp` is within the states.
Reckoned at(const Reckoning& states, Stamp stamp) {
  const auto after = std::lower_bound(states.begin() + 1, states.end() - 1, stamp,
                                      [](const Reckoned& s, Stamp t) { return s.stamp < t; });
  const Reckoned &a = *(after - 1), &b = *after;
  const double u = seconds_between(a.stamp, stamp) / seconds_between(a.stamp, b.stamp);
  Reckoned between = a;
  between.stamp = stamp;
  between.R = a.R * so3_exp(u * so3_log(a.R.transpose() * b.R));
  between.integral += u * (b.integral - a.integral);
  between.double_integral += u * (b.double_integral - a.double_integral);
  between.position += u * (b.position - a.position);
  return between;
}

// Solves `rows(pose)` * x = `value(pose)` over all recorded poses for x by least squares. The last
// three unknowns are biases, with a prior at zero. `bias_weight` is the standard deviation of a
// value divided by that of a bias.
Eigen::VectorXd least_squares(std::span<const StampedPose> poses, Eigen::Index unknowns,
                              double bias_weight, const auto& rows, const auto& value) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3 * n + 3, unknowns);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(3 * n + 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    const StampedPose& pose = poses[static_cast<std::size_t>(k)];
    A.middleRows(3 * k, 3) = rows(pose);
    b.segment<3>(3 * k) = value(pose);
  }
  A.bottomRightCorner<3, 3>() = bias_weight * Eigen::Matrix3d::Identity();
  return A.colPivHouseholderQr().solve(b);
}

// Rotates the states so that they fit the poses, each by Exp(d - integral b).
void fit_rotations(Reckoning& states, std::span<const StampedPose> poses) {
  const Eigen::VectorXd x = least_squares(
      poses, 6, kRotationNoise_rad / kGyroBias_radps,
      [&](const StampedPose& pose) {
        Eigen::Matrix<double, 3, 6> row;
        row << Eigen::Matrix3d::Identity(), -at(states, pose.stamp).integral;
        return row;
      },
      [&](const StampedPose& pose) {
        return so3_log(pose.T.linear() * at(states, pose.stamp).R.transpose());
      });
  for (Reckoned& state : states)
    state.R = so3_exp(x.head<3>() - state.integral * x.tail<3>()) * state.R;
}

// Moves the states so that they fit the poses, by a start, a velocity, and biases.
void fit_positions(Reckoning& states, std::span<const StampedPose> poses) {
  const Stamp first = states.front().stamp;
  const auto rows = [&](const Reckoned& state) {
    Eigen::Matrix<double, 3, 9> row;
    row << Eigen::Matrix3d::Identity(),
        seconds_between(first, state.stamp) * Eigen::Matrix3d::Identity(), -state.double_integral;
    return row;
  };
  const Eigen::VectorXd x = least_squares(
      poses, 9, kPositionNoise_m / kAccelBias_mps2,
      [&](const StampedPose& pose) { return rows(at(states, pose.stamp)); },
      [&](const StampedPose& pose) -> Eigen::Vector3d {
        return pose.T.translation() - at(states, pose.stamp).position;
      });
  for (Reckoned& state : states) state.position += rows(state) * x;
}

// Rows of `all` with stamps in [from, to].
template <typename Row>
std::span<const Row> within(std::span<const Row> all, Stamp from, Stamp to) {
  const auto first = std::lower_bound(all.begin(), all.end(), from,
                                      [](const Row& row, Stamp t) { return row.stamp < t; });
  const auto last =
      std::upper_bound(first, all.end(), to, [](Stamp t, const Row& row) { return t < row.stamp; });
  return {first, last};
}

// The inertial samples that span the gap and as much of its margins as possible; empty if they do
// not span it.
std::span<const ImuSample> samples_over(std::span<const ImuSample> imu, Stamp from, Stamp to) {
  const std::span<const ImuSample> part = within(imu, from - kMargin, to + kMargin);
  if (part.empty() || part.front().stamp > from || part.back().stamp < to) return {};
  for (std::size_t k = 1; k < part.size(); ++k)
    if (seconds_between(part[k - 1].stamp, part[k].stamp) > kMaxImuStep_s) return {};
  return part;
}

// The motion between two recorded poses, and shortly before and after. Empty if the inertial
// samples do not span it.
Reckoning motion_over(Stamp from, Stamp to, std::span<const StampedPose> poses,
                      std::span<const ImuSample> imu, double gravity_mps2) {
  const std::span<const ImuSample> samples = samples_over(imu, from, to);
  if (samples.empty()) return {};
  const auto around = within(poses, samples.front().stamp, samples.back().stamp);
  Reckoning states = rotations(samples, around.front().T.linear());
  fit_rotations(states, around);
  integrate_positions(states, samples, gravity_mps2);
  fit_positions(states, around);
  return states;
}

}  // namespace

BridgedPoses bridge_gaps(std::span<const StampedPose> poses, std::span<const ImuSample> imu,
                         double gravity_mps2) {
  BridgedPoses result;
  double squares = 0.0;
  std::size_t compared = 0;
  const auto bridge = [&](Stamp from, Stamp to) {
    const Reckoning states = motion_over(from, to, poses, imu, gravity_mps2);
    if (states.empty()) return static_cast<void>(++result.open_gaps);
    ++result.gaps;
    result.longest_s = std::max(result.longest_s, seconds_between(from, to));
    for (const Reckoned& state : states)
      if (state.stamp > from && state.stamp < to)
        result.poses.push_back({state.stamp, make_pose(state.R, state.position)});
    for (const StampedPose& pose : within(poses, states.front().stamp, states.back().stamp)) {
      const double off_m = (at(states, pose.stamp).position - pose.T.translation()).norm();
      squares += off_m * off_m;
      result.max_m = std::max(result.max_m, off_m);
      ++compared;
    }
  };
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (k > 0 && poses[k].stamp - poses[k - 1].stamp > kGap)
      bridge(poses[k - 1].stamp, poses[k].stamp);
    result.poses.push_back(poses[k]);
  }
  if (compared > 0) result.rms_m = std::sqrt(squares / static_cast<double>(compared));
  return result;
}

}  // namespace km
