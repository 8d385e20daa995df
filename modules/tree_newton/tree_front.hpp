#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "modules/tree_newton/frontal_cholesky.hpp"
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

/// The front of one robot in the Newton equations of a team: multifrontal Cholesky factorisation
/// (Duff, Reid, ACM TOMS 1983) up a tree, with one front per robot. Each robot adds the Schur
/// complements of its children to its own equations. It eliminates the poses that no robot outside
/// its subtree uses, and sends the remaining system to its parent. A robot may also leave public
/// poses to its parent if their elimination would add more couplings than it removes. It then sends
/// the edges between them as edges (SentEdge). All other poses reach other robots only as their
/// Schur complement on the poses sent, never directly.
///
/// Nodes are the own poses in order, then poses of other robots on which own edges end, then poses
/// that only systems of children contain. The first two groups are "followed": this robot knows
/// their values. Held poses are not nodes. The origin stays a node up to the root. Not thread-safe.
class TreeFront {
 public:
  /// Throws std::invalid_argument if an edge names an unknown pose or has no usable precision.
  explicit TreeFront(FrontGraph graph);

  /// Number of followed nodes: own poses, and poses on which own edges end.
  [[nodiscard]] std::size_t followed() const { return followed_; }
  [[nodiscard]] const KeyframeId& id(std::size_t node) const { return ids_[node]; }
  [[nodiscard]] std::size_t node_of(const KeyframeId& id) const;
  [[nodiscard]] const FrontGraph& graph() const { return graph_; }
  [[nodiscard]] Eigen::Index block() const { return graph_.dimension == 2 ? 3 : 6; }

  /// Sets the weights in [0, 1] of the edges. `decided`: they hardly change any more.
  void weigh(const std::vector<double>& weights, bool decided);
  /// True if the present weights would change the second derivatives much; if they are decided, at
  /// all.
  [[nodiscard]] bool stale() const;

  /// Adds or replaces the system of a child. Throws std::invalid_argument if it does not fit.
  void set_child(RobotId child, TreeSystem system);
  void reweigh_child(RobotId child, std::span<const NewWeight> weights);

  /// Computes second derivatives of own edges at `poses`, one pose for each of the followed()
  /// nodes.
  void linearise(std::span<const SE3> poses, Curvature curvature);
  /// Eliminates all nodes that the EliminationPlan does not keep. False if their block is not
  /// positive definite.
  [[nodiscard]] bool factorise();
  /// Like factorise(), with a small damping of all poses (Levenberg, Quart. Appl. Math. 1944). The
  /// result is usually positive definite even if a robot claims so little precision that its
  /// equations are singular to rounding. Such a robot then cannot stop the team.
  [[nodiscard]] bool factorise_damped();
  /// True if the last factorisation was damped: the inverse then yields no covariances.
  [[nodiscard]] bool damped() const { return damped_; }
  /// True if factorise() is due because own equations or those of children have changed.
  [[nodiscard]] bool changed() const { return changed_; }

  /// The system left to the parent, after factorise().
  [[nodiscard]] TreeSystem system_for_parent(std::span<const SE3> poses);
  /// Weights of edges in sent_ that have changed much since they were last sent. The call counts as
  /// sending them.
  [[nodiscard]] std::vector<NewWeight> changed_weights();

  /// Forward substitution of own gradients at `poses` and of the right-hand sides of the children.
  /// Throws std::invalid_argument if the size of a right-hand side differs from its system.
  void reduce(std::span<const SE3> poses, const std::map<RobotId, Eigen::VectorXd>& children);
  /// Reduced right-hand side of the poses left to the parent.
  [[nodiscard]] Eigen::VectorXd reduced() const;
  /// Part of this robot in the Newton decrement: squared norm of the forward-substituted rows of
  /// the eliminated poses.
  [[nodiscard]] double decrement() const;

  /// At the root: the step of the remaining poses (none, or one), and its part of the decrement.
  struct RootStep {
    Eigen::VectorXd kept;
    double decrement = 0.0;
  };
  [[nodiscard]] RootStep solve_root(bool upright) const;
  /// Back substitution: from the step of the poses left to the parent to the steps of all nodes,
  /// one column each.
  [[nodiscard]] Eigen::MatrixXd substitute_back(const Eigen::VectorXd& kept) const;
  /// The steps of the variables of a child, from `steps` of all nodes.
  [[nodiscard]] Eigen::VectorXd step_of_child(RobotId child, const Eigen::MatrixXd& steps) const;

  /// Blocks of the inverse of the second derivatives of the team, at all nodes and at the couplings
  /// of the front. `kept` are those of the poses left to the parent, in the order of the system.
  [[nodiscard]] BlockMatrix inverse(const BlockMatrix& kept) const;
  /// At the root: these blocks for errors relative to the origin. nullopt if the equations are
  /// singular. Frees the factor first, so that two never take memory at once: of the other
  /// functions, only inverse_of_child() may be called afterwards.
  [[nodiscard]] std::optional<BlockMatrix> inverse_about_origin(bool upright);
  /// The part of a child in the result of inverse(), see TreeInverse.
  [[nodiscard]] TreeInverse inverse_of_child(RobotId child, const BlockMatrix& inverse) const;
  /// The inverse at the poses left to the parent, from the message of the parent. Throws
  /// std::invalid_argument if `blocks` has another size.
  [[nodiscard]] BlockMatrix inverse_from_parent(const TreeInverse& blocks) const;

  /// Cost of own weighted edges and verticals.
  [[nodiscard]] double cost(std::span<const SE3> poses) const;

 private:
  // The place of an edge of the graph in the equations.
  struct EdgeSlot {
    int i = 0;  // node of `from`; -1: a held pose
    int j = 0;  // node of `to`
    int pair = -1;
    bool transposed = false;
    int sent = -1;  // index in sent_ if both ends are left to the parent
  };
  struct Child {
    TreeSystem system;
    std::vector<int> node = {};  // node of each of its variables
    std::vector<int> pair = {};  // pair in the plan of each of its pairs
    std::vector<bool> transposed = {};
    std::vector<int> sent = {};  // index in sent_ of each of its edges, or -1
  };
  struct SentWeight {
    RobotId child = 0;  // this robot for an own edge
    std::size_t edge = 0;
    float sent = 0.0F;
  };

  int add_node(const KeyframeId& id);
  [[nodiscard]] EdgeSlot slot_of(const PoseEdge& edge);
  [[nodiscard]] std::optional<std::size_t> origin_node() const;
  [[nodiscard]] const SE3& pose_of(int node, const KeyframeId& id,
                                   std::span<const SE3> poses) const;
  void plan();
  void place_pairs(const std::vector<NodePair>& pairs);
  [[nodiscard]] std::vector<bool> kept_nodes(const std::vector<NodePair>& pairs) const;
  [[nodiscard]] std::vector<TreeVariable> variables() const;
  void list_sent_edges();
  [[nodiscard]] SentEdge sent_edge(const SentWeight& sent, std::span<const SE3> poses,
                                   const std::vector<NodePair>& pairs) const;
  void add_child(const Child& child, BlockMatrix& A) const;
  [[nodiscard]] Eigen::MatrixXd slopes(std::span<const SE3> poses) const;
  [[nodiscard]] float weight_of(const SentWeight& sent) const;
  template <int kBlock>
  void add_own(std::span<const SE3> poses, Curvature curvature, BlockMatrix& A) const;
  [[nodiscard]] BlockMatrix assembled() const;
  // Directions in which a pose with held position may turn, and their stiffness.
  struct Tilts {
    Eigen::Matrix<double, 3, 2> directions;
    Eigen::Vector2d stiffness;
  };
  [[nodiscard]] static std::optional<Tilts> tilts_of(const BlockMatrix& held, bool upright);

  FrontGraph graph_;
  std::vector<KeyframeId> ids_;
  std::map<KeyframeId, int> foreign_;  // nodes of poses of other robots
  std::size_t followed_ = 0;
  std::vector<EdgeSlot> slots_;  // one for each edge of the graph
  std::vector<double> weights_;  // one for each edge of the graph
  bool decided_ = false;
  std::vector<double> linearised_weights_;  // weights of edges that are not in sent_
  std::map<RobotId, Child> children_;
  std::shared_ptr<const EliminationPlan> plan_;
  std::optional<FrontalCholesky> factor_;
  BlockMatrix own_;
  Curvature curvature_ = Curvature::kGaussNewton;
  std::vector<SentWeight> sent_;
  bool changed_ = true;
  bool damped_ = false;
  Eigen::MatrixXd forwarded_;
};

/// The step of one pose, of 3 or 6 entries, as a tangent vector of SE(3): planar steps are
/// [w_z; v_x; v_y].
[[nodiscard]] Vector6 tangent_of_step(const Eigen::Ref<const Eigen::VectorXd>& step);

}  // namespace km
