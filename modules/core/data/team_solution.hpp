#pragma once

#include <vector>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/robot_identity.hpp"

namespace km {

/// The last solution of a former process: a resumed robot continues from it, also if its team is
/// out of reach.
struct TeamSolution {
  Trajectory trajectory;        ///< Own poses, and the public poses of other robots that are held.
  ClosureVerdicts verdicts;     ///< On selected closures.
  std::vector<TeamPeer> peers;  ///< Last known processes of the other robots.
};

}  // namespace km
