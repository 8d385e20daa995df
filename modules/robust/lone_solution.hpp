#pragma once

#include <map>
#include <optional>
#include <vector>

#include "modules/robust/session_graph.hpp"
#include "modules/robust/tree_root.hpp"

namespace km {

/// Poses that one robot computes alone.
struct [[nodiscard]] LoneSolution {
  std::vector<SE3> poses;  ///< The last accepted ones; the start if no step was accepted.
  double barc = 0.0;       ///< Largest residual of a closure that is kept [sigma].
  bool converged = false;  ///< False: the rounds did not suffice, or there is no solution.
};

/// Solves `graph` by TreeNewton as a session of one member. `graph` has no closures to members. New
/// second derivatives are computed earlier than by default, because they cost no bytes. Throws
/// std::invalid_argument as TreeNewton does.
LoneSolution solve_alone(SessionGraph graph, TreeNewtonOptions options);

/// `graph.start`, moved to the solution of `graph`, which has no closures to members. From a start
/// that contradicts the closures inside the robot, the first steps of a session would lead far
/// away, while closures between robots are weighed. The start does not move if there are no
/// closures inside this robot, if there is no solution, or if these do not mostly_fit() it.
[[nodiscard]] std::vector<SE3> relaxed_start(SessionGraph graph, const TreeNewtonOptions& options);

/// The solution of `graph`, which has no closures to members, with all its closures, if they and
/// odometry are as precise as they claim: the hypothesis that nothing is false. The cost is then
/// chi-squared distributed, with 6 degrees of freedom (in the plane 3) for each closure that is not
/// needed to join two runs. No closure has a residual that would reject it. The start is the
/// chordal initialisation with all closures, so the test needs no odometry that is precise over
/// long distances.
[[nodiscard]] std::optional<std::vector<SE3>> solution_if_all_true(SessionGraph graph,
                                                                   TreeNewtonOptions options);

/// A solution of the own edges of a robot, and which closures it keeps.
struct [[nodiscard]] DecidedSolution {
  std::vector<SE3> poses;
  std::map<ClosureId, bool> decided;
};

/// The closures of `graph`, which has none to members, one after the other, those along the fewest
/// steps first. A closure is kept if it increases the cost of the solution by less than the cost of
/// a rejected one. With few closures that odometry hardly predicts, graduated non-convexity ends in
/// a worse minimum of this truncated cost. nullopt if it finds a lower one, or if there are more
/// than 100,000 poses times closures.
[[nodiscard]] std::optional<DecidedSolution> solution_one_by_one(const SessionGraph& graph,
                                                                 TreeNewtonOptions options);

}  // namespace km
