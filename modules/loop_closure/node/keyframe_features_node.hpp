#pragma once

#include <deque>
#include <optional>
#include <variant>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/loop_closure/keyframe_features.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// Channels of the keyframe features node; they must outlive it.
struct KeyframeFeaturesTopics {
  In<KeyframeOdometry> odometry;  ///< Indices 0, 1, 2, ...
  In<LocatedFrame> frames;        ///< Images; that of a keyframe arrives after its odometry.
  Out<Keyframe> keyframes;
};

/// Adds to the keyframes of odometry their features and the covariance accumulated along the
/// chain.
class KeyframeFeaturesNode final
    : public WorkerNode<
          std::variant<Topic<KeyframeOdometry>::Message, Topic<LocatedFrame>::Message>> {
 public:
  /// Without `keypoint_describer` keypoints have only the descriptor of ORB. Throws ConfigError if
  /// `config` is out of bounds, std::invalid_argument if the rig cannot be rectified.
  KeyframeFeaturesNode(const KeyframeFeaturesConfig& config, const StereoRig& rig,
                       const KeyframeFeaturesTopics& topics,
                       std::optional<KeypointDescriber> keypoint_describer = {});
  ~KeyframeFeaturesNode() override { stop(); }

  /// Continues after the keyframe `last` of an earlier process. The odometry of keyframes up to
  /// `last` is ignored. Call before start().
  void continue_from(const OdometryPose& last);

  /// Handle one input synchronously. The thread calls only these functions; tests and replay can
  /// call them too. Throw std::invalid_argument for an index that does not follow the previous
  /// index, and for images of a keyframe that do not fit the rig.
  void step(const KeyframeOdometry& odometry);
  void step(const LocatedFrame& located);

 private:
  void handle(const Input& input) override {
    std::visit([this](const auto& message) { step(*message); }, input);
  }

  const Camera camera_;  // left
  KeyframeFeatureExtractor extractor_;
  const Out<Keyframe> keyframes_;
  std::deque<Keyframe> without_images_;
  UncertainPose chain_;  // from the first keyframe's odometry frame to the latest keyframe
  std::uint32_t next_index_ = 0;
  std::uint32_t known_ = 0;  // number of keyframes of the earlier process
};

}  // namespace km
