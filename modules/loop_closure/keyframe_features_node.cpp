#include "modules/loop_closure/keyframe_features_node.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

constexpr std::size_t kQueueCapacity = 64;

}  // namespace

KeyframeFeaturesNode::KeyframeFeaturesNode(const KeyframeFeaturesConfig& config,
                                           const std::optional<StereoRig>& rig,
                                           Topic<KeyframeOdometry>& odometry,
                                           const Topic<Keyframe>& keyframes)
    : keyframes_(keyframes),
      worker_(
          kQueueCapacity, Overflow::kBlock, [this](const auto& message) { step(*message); },
          "keyframe_features") {
  if (rig) extractor_.emplace(*rig, checked(config));
  odometry.subscribe([this](const auto& message) { worker_.post(message); });
}

void KeyframeFeaturesNode::step(const KeyframeOdometry& odometry) {
  if (odometry.id.index != next_index_)
    throw std::invalid_argument("keyframe " + to_string(odometry.id) + " came where index " +
                                std::to_string(next_index_) + " was due");
  if (odometry.frame && !extractor_)
    throw std::invalid_argument("keyframe " + to_string(odometry.id) +
                                " has images, but the rig is unknown");
  ++next_index_;
  chain_ = compose(chain_, {odometry.T_previous_kf, odometry.covariance});
  chain_.T = odometry.T_odom_kf;  // the same product, without its rounding
  Keyframe keyframe;
  keyframe.odometry = {odometry.id, odometry.T_odom_kf, chain_.Sigma};
  keyframe.stamp = odometry.stamp;
  if (odometry.frame) keyframe.features = extractor_->extract(*odometry.frame);
  keyframes_.publish(std::move(keyframe));
}

}  // namespace km
