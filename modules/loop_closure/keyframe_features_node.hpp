#pragma once

#include <exception>
#include <optional>
#include <string_view>

#include "modules/core/covariance.hpp"
#include "modules/core/odometry.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Makes Keyframes of the keyframes of odometry: features from the images, and the covariance
/// accumulated along the chain. In: `odometry`, indices 0, 1, 2, ... Out: `keyframes`. A keyframe
/// without images (recorded pose graphs) has no features.
class KeyframeFeaturesNode final : public Node {
 public:
  /// Without a `rig` no keyframe may have images. Throws ConfigError if `config` is out of bounds,
  /// std::invalid_argument if the rig cannot be rectified. Both topics outlive the node.
  KeyframeFeaturesNode(const KeyframeFeaturesConfig& config, const std::optional<StereoRig>& rig,
                       Topic<KeyframeOdometry>& odometry, const Topic<Keyframe>& keyframes);

  std::string_view name() const override { return "keyframe_features"; }
  void start() override { worker_.start(); }
  void stop() noexcept override { worker_.stop(); }
  std::exception_ptr error() const override { return worker_.error(); }

  /// Handles one input synchronously. The thread calls only this; so can tests and replay. Throws
  /// std::invalid_argument for an index that does not follow the one before, or images without a
  /// rig.
  void step(const KeyframeOdometry& odometry);

 private:
  std::optional<KeyframeFeatureExtractor> extractor_;
  const Topic<Keyframe>& keyframes_;
  UncertainPose chain_;  // from the first keyframe's odometry frame to the latest keyframe
  std::uint32_t next_index_ = 0;
  Worker<Topic<KeyframeOdometry>::Message> worker_;  // last member: stops first
};

}  // namespace km
