#include "modules/vio/rest_detector.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace km {
namespace {

constexpr double kSmoothing_s = 0.2;     // averages the vibration of idling rotors
constexpr double kHold = 2.0;            // factor on kRestParallax_px while the body rests
constexpr double kMostSpeed_mps = 0.05;  // bound on the estimated speed at rest

}  // namespace

std::optional<double> image_motion_px(const TrackedFrame& a, const TrackedFrame& b,
                                      double focal_px) {
  constexpr std::size_t kMinFeatures = 15;
  std::vector<double> distances;
  auto there = b.features.begin();
  for (const TrackedFeature& feature : a.features) {  // both lists ascend by id
    while (there != b.features.end() && there->id < feature.id) ++there;
    if (there == b.features.end()) break;
    if (there->id == feature.id)
      distances.push_back(focal_px * (there->left - feature.left).norm());
  }
  if (distances.size() < kMinFeatures) return std::nullopt;
  const auto median = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), median, distances.end());
  return *median;
}

bool RestDetector::add(const InertialFrame& frame, const OdometryState& state) {
  filter(frame, state);
  const auto moved_px = image_motion_px(first_, frame.tracked, focal_px_);
  const double allowed_px = (rests_ ? kHold : 1.0) * kRestParallax_px;
  const bool still = moved_px && *moved_px < allowed_px && gyro_.norm() < kRestGyro_radps &&
                     accel_.norm() < kRestAccel_mps2 && state.v_odom.norm() < kMostSpeed_mps;
  if (!still) first_ = frame.tracked;
  rests_ = still && seconds_between(first_.stamp, frame.tracked.stamp) >= config_.rest_s;
  return rests_;
}

void RestDetector::filter(const InertialFrame& frame, const OdometryState& state) {
  const Eigen::Vector3d up_body = state.T_odom_body.linear().row(2).transpose();
  const Eigen::Vector3d accel_at_rest = config_.gravity_mps2 * up_body + state.accel_bias;
  for (const ImuSample& sample : frame.samples) {
    if (last_sample_ && sample.stamp <= *last_sample_) continue;
    const double dt = last_sample_ ? seconds_between(*last_sample_, sample.stamp) : 0.0;
    const double share = 1.0 - std::exp(-dt / kSmoothing_s);
    gyro_ += share * (sample.gyro - state.gyro_bias - gyro_);
    accel_ += share * (sample.accel - accel_at_rest - accel_);
    last_sample_ = sample.stamp;
  }
}

}  // namespace km
