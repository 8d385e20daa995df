#include "modules/loop_closure/node/keyframe_features_node.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

constexpr std::size_t kFrameQueue = 64;

}  // namespace

KeyframeFeaturesNode::KeyframeFeaturesNode(const KeyframeFeaturesConfig& config,
                                           const StereoRig& rig,
                                           const KeyframeFeaturesTopics& topics,
                                           std::optional<KeypointDescriber> keypoint_describer)
    : WorkerNode({.name = "keyframe_features", .queue = kFrameQueue}),
      camera_(rig.cameras[0]),
      extractor_(rig, config, std::move(keypoint_describer)),
      keyframes_(topics.keyframes) {
  follow(topics.odometry, topics.frames);
}

void KeyframeFeaturesNode::continue_from(const OdometryPose& last) {
  chain_ = {last.T_odom_kf, last.covariance};
  known_ = next_index_ = last.id.index + 1;
}

void KeyframeFeaturesNode::step(const KeyframeOdometry& odometry) {
  if (odometry.id.index < known_) return;
  if (odometry.id.index != next_index_)
    throw std::invalid_argument("keyframe " + to_string(odometry.id) + " came where index " +
                                std::to_string(next_index_) + " was due");
  ++next_index_;
  chain_ = compose(chain_, {odometry.T_previous_kf, odometry.covariance});
  chain_.T = odometry.T_odom_kf;  // equal to the product, without its rounding errors
  Keyframe& keyframe = without_images_.emplace_back();
  keyframe.odometry = {odometry.id, odometry.T_odom_kf, chain_.Sigma};
  keyframe.stamp = odometry.stamp;
  if (odometry.calibration)
    keyframe.features.mounting = odometry.calibration->covariance.block<6, 6>(1, 1);
}

void KeyframeFeaturesNode::step(const LocatedFrame& located) {
  if (without_images_.empty() || without_images_.front().stamp != located.frame->stamp) return;
  KeyframeFeatures features = extractor_.extract(*located.frame);
  features.T_body_cam = located.T_body_rig * features.T_body_cam;
  unroll(camera_, located.readout_s, located.twist_body, features);
  Keyframe keyframe = std::move(without_images_.front());
  without_images_.pop_front();
  features.mounting = keyframe.features.mounting;
  keyframe.features = std::move(features);
  keyframes_.publish(std::move(keyframe));
}

}  // namespace km
