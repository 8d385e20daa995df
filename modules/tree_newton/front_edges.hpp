#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "modules/tree_newton/pose_edge.hpp"
#include "modules/tree_newton/tree_system.hpp"
#include "modules/tree_newton/vertical_prior.hpp"

namespace km {

/// The contribution of one robot to the equations of its team.
struct FrontGraph {
  RobotId self = 0;
  Eigen::Index poses = 0;
  int dimension = 3;                    ///< 2: poses and measurements are planar.
  std::vector<PoseEdge> edges = {};     ///< Edges with at least one end on this robot.
  std::map<KeyframeId, SE3> held = {};  ///< Poses of other robots that do not move.
  std::vector<VerticalPrior> verticals = {};
  /// Own poses that may be sent to other robots.
  std::set<KeyframeIndex> open = {};
  /// Number of robots, including this one, whose edges end on an own pose. Poses without an entry:
  /// only this robot.
  std::map<KeyframeIndex, std::uint32_t> touched_by = {};
  bool root = false;  ///< Root of the tree: it has no parent to leave poses to.
  /// Nothing holds the frame of the team: the root then holds one pose and solves for all others.
  bool free = true;
  std::optional<KeyframeId> origin = {};  ///< nullopt: no covariances are needed.
};

/// The place of an edge, or of a coupling, in the equations of a front.
struct EdgeSlot {
  int i = -1;  ///< Nodes of its ends; -1: a held pose.
  int j = -1;
  int pair = -1;      ///< Their coupling in the plan.
  bool sent = false;  ///< Both ends are left to the parent.

  [[nodiscard]] bool couples() const { return i >= 0 && j >= 0; }
};

/// The edges and verticals of one robot: their cost and derivatives at given poses, one pose for
/// each node on which they end. Nodes are the own poses in order, then poses of other robots. Edges
/// that are sent to the parent have no part in the second derivatives. Not thread-safe.
class FrontEdges {
 public:
  /// Throws std::invalid_argument if an edge names an unknown pose or has no usable precision.
  explicit FrontEdges(FrontGraph graph);

  [[nodiscard]] const FrontGraph& graph() const { return graph_; }
  [[nodiscard]] Eigen::Index block() const { return graph_.dimension == 2 ? 3 : 6; }

  /// All nodes; add_node() appends those of other robots.
  [[nodiscard]] std::span<const KeyframeId> nodes() const { return nodes_; }
  int add_node(const KeyframeId& id);
  [[nodiscard]] std::optional<std::size_t> find(const KeyframeId& id) const;

  /// One for each edge.
  [[nodiscard]] std::span<EdgeSlot> slots() { return slots_; }
  [[nodiscard]] std::span<const EdgeSlot> slots() const { return slots_; }

  /// Sets the weights in [0, 1] of the first edges; the others have weight 1. `decided`: they
  /// hardly change any more.
  void weigh(std::vector<double> weights, bool decided);
  [[nodiscard]] double weight(std::size_t edge) const { return weights_[edge]; }
  /// True if the present weight of an edge makes its equations with the weight `before` misleading;
  /// if weights are decided, inaccurate.
  [[nodiscard]] bool misleads(double weight, double before) const;
  /// True if the second derivatives are due, because weights or slots have changed.
  [[nodiscard]] bool stale() const;

  /// Cost of the weighted edges and the verticals.
  [[nodiscard]] double cost(std::span<const SE3> poses) const;
  /// Negative gradients of all nodes, one below the other.
  [[nodiscard]] Eigen::MatrixXd slopes(std::span<const SE3> poses) const;
  /// Computes second derivatives; `pairs`: number of couplings of the plan.
  void linearise(std::span<const SE3> poses, Curvature curvature, std::size_t pairs);
  [[nodiscard]] const BlockMatrix& second_derivatives() const { return H_; }
  /// The slots are new: second derivatives are due.
  void forget_derivatives() { linearised_weights_.clear(); }
  /// An edge as it is sent, without its place in the system.
  [[nodiscard]] SentEdge sent_edge(std::size_t edge, std::span<const SE3> poses) const;

 private:
  [[nodiscard]] const SE3& pose_of(int node, const KeyframeId& id,
                                   std::span<const SE3> poses) const;
  template <int kBlock>
  void add_edges(std::span<const SE3> poses);

  FrontGraph graph_;
  std::vector<KeyframeId> nodes_;
  std::map<KeyframeId, int> foreign_;  // nodes of poses of other robots
  std::vector<EdgeSlot> slots_;
  std::vector<double> weights_;
  bool decided_ = false;
  std::vector<double> linearised_weights_;  // at the last linearise()
  Curvature curvature_ = Curvature::kGaussNewton;
  BlockMatrix H_;
};

/// First row of a planar step in a tangent vector of SE(3): rotation about z and translation along
/// x and y are adjacent.
[[nodiscard]] constexpr Eigen::Index first_row_of(Eigen::Index block) {
  return block == 3 ? 2 : 0;
}

}  // namespace km
