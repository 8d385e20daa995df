#pragma once

#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "modules/pose_graph/closure_verdicts.hpp"
#include "modules/pose_graph/newton/robot_graph.hpp"
#include "modules/pose_graph/pgo_method.hpp"
#include "modules/pose_graph/solver_message.hpp"

namespace km {

/// How far the team is, as every member knows it.
struct SolverProgress {
  double cost = 0.0;       ///< Of the team, at poses().
  double decrement = 0.0;  ///< sqrt(g^T H^-1 g) there: the gradient in the metric of the Hessian.
};

/// One robot's part in solving a session's graph by exchanges (see SolverMessage), in which all
/// members come to the same decisions from the same messages. Messages may come early, in any order
/// and repeatedly. Not thread-safe.
class SessionSolver {
 public:
  virtual ~SessionSolver() = default;

  /// What this robot sends first.
  [[nodiscard]] virtual SolverContent hello() const = 0;
  /// From a member, this robot included: what advance() returns does not count before.
  virtual void receive(const SolverMessagePtr& message) = 0;
  /// True if an exchange is complete.
  [[nodiscard]] virtual bool ready() const = 0;
  /// What to send next; nullopt if the exchange is not complete, or if that was the last.
  /// Throws std::exception if the team's graph or a member's message cannot be used.
  [[nodiscard]] virtual std::optional<SolverContent> advance() = 0;
  [[nodiscard]] virtual bool done() const = 0;

  /// Poses of this robot with the lowest cost that the team has agreed on.
  [[nodiscard]] virtual const std::vector<SE3>& poses() const = 0;
  [[nodiscard]] virtual SolverProgress progress() const = 0;
  /// The closures of this robot, as things stand; empty if the method uses all it is given.
  [[nodiscard]] virtual ClosureVerdicts verdicts() const { return {}; }
};

/// The solver of `method`, which must be one that goes by exchanges. `start`: this robot's poses,
/// in the frame of the session. `upright`: that has z up, and some member has vertical priors (not
/// used by kGnc). `gnc_barc`: see PoseGraphConfig. The first edges of its own are its
/// odometry, one per pose but the first.
[[nodiscard]] std::unique_ptr<SessionSolver> make_session_solver(PgoMethod method, double gnc_barc,
                                                                 RobotEdges edges,
                                                                 std::set<RobotId> members,
                                                                 std::vector<SE3> start,
                                                                 bool upright);

}  // namespace km
