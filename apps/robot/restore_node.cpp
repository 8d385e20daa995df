#include "apps/robot/restore_node.hpp"

#include <cstddef>
#include <utility>

#include "runtime/log.hpp"

namespace km {

void RestoreNode::start() {
  RestoredRun run = std::exchange(run_, {});
  // Published before the keyframes, so that the optimiser continues from the solution, and the
  // outcome of a candidate is known when it is found again.
  if (!run.solution.trajectory.T_world_kf.empty())
    topics_.solution.publish(std::move(run.solution));
  for (ClosureOutcome& outcome : run.outcomes) topics_.outcomes.publish(std::move(outcome));
  for (OdometryState& state : run.states) topics_.states.publish(std::move(state));
  for (std::size_t i = 0; i < run.keyframes.size(); ++i) {
    topics_.odometry.publish(std::move(run.odometry[i]));
    topics_.keyframes.publish(std::move(run.keyframes[i]));
  }
  for (Closure& closure : run.closures) {
    const bool own = closure.from.id.robot == run.robot;
    (own ? topics_.own_closures : topics_.peer_closures).publish(std::move(closure));
  }
  for (InlierSet& set : run.inlier_sets) topics_.inlier_sets.publish(std::move(set));
  log::info(name()) << run.keyframes.size() << " keyframes, " << run.closures.size()
                    << " closures restored";
}

}  // namespace km
