#pragma once

#include <cstddef>
#include <vector>

#include "apps/lab/pgo/round_meter.hpp"
#include "apps/lab/pgo/team_graph.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"
#include "modules/robust/member_solver.hpp"
#include "modules/session/pose_graph_config.hpp"

namespace km {

/// An edge of a team's graph as a closure between robots. Robot k has id k, and its keyframes are
/// its poses, numbered from 0.
struct TeamClosure {
  std::size_t edge = 0;  ///< Index in TeamGraph::edges.
  Closure closure;       ///< Closure with the odometry of both ends.
};

/// All edges that are no step of a robot's own odometry, in the order of the edges. Odometry
/// between two robots is included.
[[nodiscard]] std::vector<TeamClosure> team_closures(const TeamGraph& graph);

struct AgentTeamOptions {
  PoseGraphConfig pose_graph = {};
  PcmConfig pcm = {};            ///< Decides when the closures of a pair count; `selection` is
                                 ///< witness.
  double keyframes_per_s = 0.0;  ///< Rate at which robots play their graphs [1/s]; 0: all at once.
  /// Seed of random times: robots start and meet within the first 20 s, and messages take 30 ms on
  /// average. 0: robots meet at once, and each message takes 1 ms.
  unsigned seed = 0;
  /// With a seed: until 40 s, every two seconds another third of the robots, drawn at random, is
  /// out of reach of all. Messages to and from it wait.
  bool outages = false;
  TeamMeter meter = {};
};

/// Messages and processor time of one robot of a run.
struct AgentCost {
  std::size_t sent = 0;      ///< Bytes; a message counts once per receiver.
  std::size_t received = 0;  ///< Bytes.
  double cpu_s = 0.0;
};

/// Result of a run.
struct AgentTeamRun {
  std::vector<SE3> T_world_kf;    ///< Published poses, in the numbering of the graph.
  std::vector<RobotId> world_of;  ///< By robot: id of the robot whose odometry frame is its
                                  ///< `world`.
  std::vector<bool> kept;         ///< By edge of the graph: used in the published solution.
  bool settled = false;           ///< False: the run ended after an hour of virtual time.
  double seconds = 0.0;           ///< Virtual time of the last change [s].
  std::size_t rounds = 0;         ///< In all sessions, maximum over the robots.
  SolverState last = {};          ///< State of robot 0 at the end of its last session.
  double critical_path_s = 0.0;   ///< CPU time of the slowest robot, summed over all steps.
  std::size_t bytes = 0;          ///< Sent by all robots; a message counts once per receiver.
  std::vector<AgentCost> costs;   ///< By robot.
};

/// Runs the robots' own code on a recorded graph, from measurements to published poses. Each robot
/// is a TeamAgent with the solvers of solver_choice(). The agents exchange encoded messages over
/// perfect links in virtual time. Closures inside a robot count at once. Closures between two
/// robots count when WitnessedPair has its witnesses, or `pcm.witness_wait_s` after the first one.
/// If several closures join the same two poses, the robots use one (see OwnGraph), and all of
/// them have the same value in `kept`. Deterministic.
[[nodiscard]] AgentTeamRun run_agent_team(const TeamGraph& graph, const AgentTeamOptions& options);

}  // namespace km
