#pragma once

#include <span>
#include <utility>
#include <vector>

#include "modules/robust/tree_messages.hpp"
#include "modules/tree_newton/front_edges.hpp"

namespace km {

/// How an edge of the front of a member is weighed.
struct EdgeWeight {
  RobotId peer = 0;         ///< The other robot of the edge; this robot for an edge inside it.
  bool is_between = false;  ///< `peer` is another robot.
  bool is_odometry = false;
  bool is_open = false;  ///< May be rejected.
  /// Decided by the start: open, but not weighed unless the solution contradicts it.
  bool is_settled = false;
  bool is_doubted = false;       ///< Rejected by doubt().
  bool was_lifted = false;       ///< A doubt has been lifted: it is not lifted again.
  bool is_contradicted = false;  ///< The present poses contradict its decided weight.
  double weight = 1.0;           ///< At the accepted poses.
  double candidate = 1.0;        ///< At the present poses.
  double volume = 1.0;           ///< In which it may end if it is false [m^3], in the plane [m^2].
  double pair_limit = 1.0;       ///< Factor on the weight while the pair of the edge is limited.
  bool is_limited = true;        ///< At the accepted poses.
  bool may_be_limited = true;    ///< At the present poses.
};

/// The weights of the edges of a member while the team takes steps: graduated non-convexity, and
/// the limits of pairs. Not thread-safe.
class EdgeWeights {
 public:
  /// `edges`: of the first edges of the front. `left_out`: number of rejected closures of this
  /// robot that are no edges.
  explicit EdgeWeights(std::vector<EdgeWeight> edges, std::uint32_t left_out = 0)
      : edges_(std::move(edges)), left_out_(left_out) {}

  /// All open closures are weighed from now on.
  void unsettle();
  /// Computes the weights at the present poses of the nodes of `front`. The root may still reject
  /// these poses. Adds the counts of closures and the pulls of limited pairs to `sums`.
  void weigh(const TreeVerdict& verdict, const FrontEdges& front, std::span<const SE3> present,
             TreeSums& sums);
  /// Rejects the closures that are likelier false than true, at converged `poses`. The error of a
  /// closure against all other edges follows from its residual and the `inverse` of the second
  /// derivatives of the team. If it is true, this error has the covariance of the closure and of
  /// its ends without it, both scaled by the noise of `verdict`. Earlier doubts are lifted if they
  /// no longer hold. See Decisions in METHOD.md.
  void doubt(const TreeVerdict& verdict, const FrontEdges& front, std::span<const SE3> poses,
             const BlockMatrix& inverse);
  /// The weights at the present poses become the accepted ones.
  void accept();

  /// Weights of the edges in the equations, at the present or at the accepted poses.
  [[nodiscard]] std::vector<double> in_equations(bool present) const;
  [[nodiscard]] bool keeps(std::size_t edge) const { return edges_[edge].weight > 0.5; }

 private:
  void weigh_open(EdgeWeight& edge, const TreeVerdict& verdict, double residual, TreeSums& sums);
  void limit_pairs(const TreeVerdict& verdict, const FrontEdges& front,
                   std::span<const SE3> present, TreeSums& sums);

  std::vector<EdgeWeight> edges_;
  std::uint32_t left_out_ = 0;
  std::uint32_t doubted_ = 0;  // changes by doubt() that no sums have counted
};

}  // namespace km
