#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "modules/outlier_rejection/pcm_config.hpp"
#include "modules/pgo_study/team_graph.hpp"
#include "modules/pose_graph/pose_graph_config.hpp"

namespace km {

struct AgentTeamOptions {
  PoseGraphConfig pose_graph = {};
  PcmConfig pcm = {};            ///< Says when a pair of robots is joined; `selection` is witness.
  double keyframes_per_s = 0.0;  ///< At which robots play their graphs; 0: all of it at once.
  double longest_s = 3600.0;     ///< Virtual time after which the run ends where it is.
};

/// Result of a run.
struct AgentTeamRun {
  std::vector<SE3> T_world_kf;    ///< As published, in the numbering of the graph.
  std::vector<RobotId> world_of;  ///< By robot: the robot whose odometry frame its poses are in.
  std::vector<bool> kept;         ///< By edge of the graph: used in the solution published.
  bool settled = false;           ///< Else longest_s did not suffice.
  double seconds = 0.0;           ///< Virtual time until nothing changed any more.
  std::size_t rounds = 0;         ///< Most rounds of any robot.
  std::size_t bytes = 0;          ///< Sent by all, each reader counted.
  std::vector<std::string> notices;
};

/// A recorded graph run by the robots' own code, from measurements to what they publish: one
/// TeamAgent per robot with the robots' solvers (solver_choice()), which exchange encoded messages
/// over perfect links in virtual time. Closures inside a robot count at once. Those between two
/// robots count once WitnessedPair has its witnesses, or `pcm.witness_wait_s` after the first one.
/// Robots use one of several closures between the same two poses (see OwnGraph). `kept` is the same
/// for all of these. Deterministic. Throws std::invalid_argument if the graph is planar or a
/// robot's odometry is interrupted.
[[nodiscard]] AgentTeamRun run_agent_team(const TeamGraph& graph, const AgentTeamOptions& options);

}  // namespace km
