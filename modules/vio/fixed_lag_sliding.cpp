#include <algorithm>
#include <utility>

#include "modules/vio/fixed_lag_smoother.hpp"
#include "modules/vio/window_sliding.hpp"

// How the window of FixedLagSmoother moves on.
namespace km {
namespace {

constexpr double kHeldPosition_m = 1e-3;  // of the first state: fixes the gauge, no more
constexpr double kHeldHeading_rad = 1e-3;
constexpr double kGyroBiasSigma = 0.02;  // around the guess of the start [rad/s]

}  // namespace

void FixedLagSmoother::hold_first() {
  const OdometryState& first = window_.frames.front().state;
  StatePrior& prior = window_.prior;
  prior.frames = {window_.frames.front().id};
  prior.linearization = {first};
  prior.J = Eigen::MatrixXd::Zero(10, 15);
  prior.r = Eigen::VectorXd::Zero(10);
  // Heading: the rotation about the vertical, seen from the body.
  prior.J.block<1, 3>(0, 0) = first.T_odom_body.linear().row(2) / kHeldHeading_rad;
  prior.J.block<3, 3>(1, 3).diagonal().setConstant(1.0 / kHeldPosition_m);
  prior.J.block<3, 3>(4, 9).diagonal().setConstant(1.0 / kGyroBiasSigma);
  prior.J.block<3, 3>(7, 12).diagonal().setConstant(1.0 / config_.accel_bias_sigma);
}

void FixedLagSmoother::slide() {
  for (std::size_t k = window_.frames.size(); k-- > 1;) {
    const bool recent =
        k + static_cast<std::size_t>(config_.window_recent) >= window_.frames.size();
    if (!recent && !window_.frames[k].keyframe) merge_out(k);
  }
  while (keyframes() > static_cast<std::size_t>(config_.window_keyframes))
    marginalize_oldest(window_);
  const auto gone = [&](const WindowLandmark& landmark) {
    return landmark.observations.size() < 2 && !tracked_now(window_, landmark);
  };
  std::erase_if(window_.landmarks, gone);
}

void FixedLagSmoother::merge_out(std::size_t frame) {
  std::vector<ImuSample> samples = std::move(window_.frames[frame].samples);
  std::vector<ImuSample>& later = window_.frames[frame + 1].samples;
  for (const ImuSample& sample : later)
    if (sample.stamp > samples.back().stamp) samples.push_back(sample);
  later = std::move(samples);
  forget_frame(window_, frame);
  set_imu(frame);
}

}  // namespace km
