#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "modules/tree_newton/front_edges.hpp"
#include "modules/tree_newton/frontal_cholesky.hpp"

namespace km {

/// The front of one robot in the Newton equations of a team: multifrontal Cholesky factorisation
/// (Duff, Reid, ACM TOMS 1983) up a tree, with one front per robot. Each robot adds the Schur
/// complements of its children to its own equations. It eliminates the poses that no robot outside
/// its subtree uses, and sends the remaining system to its parent. A robot may also leave public
/// poses to its parent if their elimination would add more couplings than it removes. It then sends
/// the edges between them as edges (SentEdge). All other poses reach other robots only as their
/// Schur complement on the poses sent, never directly.
///
/// Nodes are those of the own edges, then poses that only systems of children contain. This robot
/// knows the values of the first ones, which are "followed". Held poses are not nodes. The origin
/// stays a node up to the root. Not thread-safe.
class TreeFront {
 public:
  /// Throws std::invalid_argument as FrontEdges does.
  explicit TreeFront(FrontGraph graph)
      : own_(std::move(graph)), followed_(own_.nodes().begin(), own_.nodes().end()) {}

  /// The own edges: weights, cost, and the numbers of nodes.
  [[nodiscard]] FrontEdges& own() { return own_; }
  [[nodiscard]] const FrontEdges& own() const { return own_; }
  /// The followed nodes.
  [[nodiscard]] const std::vector<KeyframeId>& followed() const { return followed_; }

  /// Takes the new system of a child, if there is one, then new weights of its edges. Throws
  /// std::invalid_argument if they do not fit.
  void update_child(RobotId child, std::optional<TreeSystem> system,
                    std::span<const NewWeight> weights);

  /// Computes second derivatives of own edges at `poses`, one pose for each of the followed()
  /// nodes.
  void linearise(std::span<const SE3> poses, Curvature curvature);
  /// Eliminates all nodes that the EliminationPlan does not keep. False if their block is not
  /// positive definite. `damped`: with a small damping of all poses (Levenberg, Quart. Appl. Math.
  /// 1944). It is then usually positive definite even if a robot claims so little precision that
  /// its equations are singular to rounding. Such a robot cannot stop the team.
  [[nodiscard]] bool factorise(bool damped = false);
  /// True if the last factorisation was damped: the inverse then yields no covariances.
  [[nodiscard]] bool damped() const { return damped_; }
  /// True if factorise() is due because own equations or those of children have changed.
  [[nodiscard]] bool changed() const { return changed_; }

  /// The system left to the parent, after factorise().
  [[nodiscard]] TreeSystem system_for_parent(std::span<const SE3> poses);
  /// Weights of sent edges that have changed much since they were last sent. The call counts as
  /// sending them.
  [[nodiscard]] std::vector<NewWeight> changed_weights();

  /// A right-hand side after forward substitution.
  struct Reduced {
    Eigen::VectorXd kept;  ///< At the poses left to the parent.
    /// Part of this robot in the Newton decrement: squared norm at the eliminated poses.
    double decrement = 0.0;
  };
  /// Forward substitution of own gradients at `poses` and of the right-hand sides of the children.
  /// Throws std::invalid_argument if the size of a right-hand side differs from its system.
  [[nodiscard]] Reduced reduce(std::span<const SE3> poses,
                               const std::map<RobotId, Eigen::VectorXd>& children);

  /// At the root: the step of the remaining poses (none, or one), and its part of the decrement.
  [[nodiscard]] Reduced solve_root(bool upright) const;
  /// Back substitution: from the step of the poses left to the parent to the steps of all nodes,
  /// one column each.
  [[nodiscard]] Eigen::MatrixXd substitute_back(const Eigen::VectorXd& kept) const;
  /// The steps of the variables of a child, from `steps` of all nodes.
  [[nodiscard]] Eigen::VectorXd step_of_child(RobotId child, const Eigen::MatrixXd& steps) const;

  /// Blocks of the inverse of the second derivatives of the team, at all nodes and at the couplings
  /// of the front, from those at the poses left to the parent. nullopt if these have another size.
  [[nodiscard]] std::optional<BlockMatrix> inverse(const TreeInverse& from_parent) const;
  /// At the root: these blocks for errors relative to the origin. nullopt if the equations are
  /// singular. Frees the factor first, so that two never take memory at once: of the other
  /// functions, only inverse_of_child() may be called afterwards.
  [[nodiscard]] std::optional<BlockMatrix> inverse_about_origin(bool upright);
  /// At the root: these blocks for errors relative to the pose that Newton steps hold.
  [[nodiscard]] BlockMatrix inverse_about_held(bool upright) const;
  /// The part of a child in `inverse`. `fine`: see TreeInverse.
  [[nodiscard]] TreeInverse inverse_of_child(RobotId child, const BlockMatrix& inverse,
                                             bool fine = false) const;

 private:
  struct Child {
    TreeSystem system;
    std::vector<int> node = {};        // by variable of the system
    std::vector<EdgeSlot> pairs = {};  // by pair of the system
    [[nodiscard]] EdgeSlot slot_of(const SentEdge& edge) const;
  };
  struct SentWeight {
    RobotId child = 0;  // this robot for an own edge
    std::size_t edge = 0;
    float sent = 0.0F;
  };

  void plan();
  [[nodiscard]] std::vector<TreeVariable> variables() const;
  [[nodiscard]] std::vector<bool> kept_nodes(const std::vector<NodePair>& pairs) const;
  void list_sent_edges();
  [[nodiscard]] float weight_of(const SentWeight& sent) const;
  [[nodiscard]] SentEdge sent_edge(const SentWeight& sent, std::span<const SE3> poses) const;
  void add_child(const Child& child, BlockMatrix& A) const;
  [[nodiscard]] BlockMatrix assembled() const;

  FrontEdges own_;
  std::vector<KeyframeId> followed_;
  std::map<RobotId, Child> children_;
  std::shared_ptr<const EliminationPlan> plan_;
  std::optional<FrontalCholesky> factor_;
  std::vector<SentWeight> sent_;
  bool changed_ = true;
  bool damped_ = false;
  Eigen::MatrixXd forwarded_;
};

/// The step of one pose, of 3 or 6 entries, as a tangent vector of SE(3): planar steps are
/// [w_z; v_x; v_y].
[[nodiscard]] inline Vector6 tangent_of_step(const Eigen::Ref<const Eigen::VectorXd>& step) {
  Vector6 xi = Vector6::Zero();
  xi.segment(first_row_of(step.size()), step.size()) = step;
  return xi;
}

}  // namespace km
