#pragma once

#include <exception>
#include <string_view>
#include <utility>

#include "modules/core/keyframe.hpp"
#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/journal/restored_run.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"

namespace km {

/// Topics on which a restored run is published. All topics must outlive the node.
struct RestoreTopics {
  Out<OdometryState> states;
  Out<KeyframeOdometry> odometry;
  Out<Keyframe> keyframes;
  Out<Closure> own_closures;
  Out<Closure> peer_closures;
  Out<ClosureOutcome> outcomes;
  Out<InlierSet> inlier_sets;
};

/// Publishes a restored run once, before any source starts. The nodes that read its messages reach
/// the state that they had in the former process. Has no thread: start() returns when all messages
/// are published.
class RestoreNode final : public Node {
 public:
  explicit RestoreNode(const RestoreTopics& topics) : topics_(topics) {}

  /// Sets the run to publish. Call before start().
  void set(RestoredRun run) { run_ = std::move(run); }

  std::string_view name() const override { return "restore"; }
  void start() override;
  void stop() noexcept override {}
  std::exception_ptr error() const override { return nullptr; }

 private:
  RestoredRun run_;  // empty once it is published
  const RestoreTopics topics_;
};

}  // namespace km
