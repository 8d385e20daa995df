#pragma once

#include <memory>

#include "modules/surface_ties/node/surface_ties_node.hpp"
#include "test/modules/surface_ties/chunks.hpp"
#include "test/support/inbox.hpp"

namespace km {

/// A SurfaceTiesNode with its channels. The ties that it makes are kept.
struct TiedRobot {
  explicit TiedRobot(RobotId self)
      : node(self, kMaxGap,
             {.own_chunks = own_chunks,
              .peer_chunks = peer_chunks,
              .own_poses = own_poses,
              .peer_poses = peer_poses,
              .closures = closures,
              .progress = progress,
              .restarts = restarts,
              .ties = ties,
              .outcomes = outcomes}) {}

  template <typename T>
  void give(const T& message) {
    node.step(std::make_shared<const T>(message), 0.0);
  }
  /// Ticks until nothing is left to register.
  void run() {
    for (double now_s = 100.0; now_s < 1e9; now_s *= 2.0) node.step(SurfaceTiesNode::Tick(), now_s);
  }

  Topic<MeshChunk> own_chunks, peer_chunks;
  Topic<MeshPoses> own_poses, peer_poses;
  Topic<Closure> closures, ties;
  Topic<OptimizerProgress> progress;
  Topic<PeerEvent> restarts;
  Topic<ClosureOutcome> outcomes;
  Inbox<Closure> made{ties};
  Inbox<ClosureOutcome> reported{outcomes};
  SurfaceTiesNode node;
};

}  // namespace km
