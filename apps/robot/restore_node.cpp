#include "apps/robot/restore_node.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

#include "runtime/log.hpp"

namespace km {

namespace {

// Index of the last keyframe of `robot` on which the closure ends.
KeyframeIndex last_end(const Closure& closure, RobotId robot) {
  KeyframeIndex last = 0;
  for (const KeyframeId& end : {closure.from.id, closure.to.id})
    if (end.robot == robot) last = std::max(last, end.index);
  return last;
}

}  // namespace

// A closure follows its last keyframe, as in the former process: place recognition thus knows again
// at which keyframes the place was known.
void RestoreNode::start() {
  RestoredRun run = std::exchange(run_, {});
  // Before the keyframes, so that the outcome of a candidate is known when it is found again.
  for (ClosureOutcome& outcome : run.outcomes) topics_.outcomes.publish(std::move(outcome));
  for (OdometryState& state : run.states) topics_.states.publish(std::move(state));
  const auto end_of = [&](const Closure& closure) { return last_end(closure, run.robot); };
  std::ranges::stable_sort(run.closures, {}, end_of);
  auto next = run.closures.begin();
  const auto publish_closures_until = [&](KeyframeIndex keyframe) {
    for (; next != run.closures.end() && end_of(*next) <= keyframe; ++next)
      (next->from.id.robot == run.robot ? topics_.own_closures : topics_.peer_closures)
          .publish(*next);
  };
  for (std::size_t i = 0; i < run.keyframes.size(); ++i) {
    const KeyframeIndex index = run.odometry[i].id.index;
    topics_.odometry.publish(std::move(run.odometry[i]));
    topics_.keyframes.publish(std::move(run.keyframes[i]));
    publish_closures_until(index);
  }
  publish_closures_until(std::numeric_limits<KeyframeIndex>::max());
  for (InlierSet& set : run.inlier_sets) topics_.inlier_sets.publish(std::move(set));
  log::info(name()) << run.keyframes.size() << " keyframes, " << run.closures.size()
                    << " closures restored";
}

}  // namespace km
