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

/// Where a restored run goes. All topics must outlive the node.
struct RestoreTopics {
  Out<OdometryState> states;
  Out<KeyframeOdometry> odometry;
  Out<Keyframe> keyframes;
  Out<Closure> own_closures;
  Out<Closure> peer_closures;
  Out<ClosureOutcome> outcomes;
};

/// Publishes a run that was restored, once and before any source starts: the nodes behind it come
/// to where they were, as if they had seen it all. Has no thread: start() returns when all is
/// published.
class RestoreNode final : public Node {
 public:
  explicit RestoreNode(const RestoreTopics& topics) : topics_(topics) {}

  /// What to publish. Call before start().
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
