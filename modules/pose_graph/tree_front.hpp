#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "modules/pose_graph/frontal_cholesky.hpp"
#include "modules/pose_graph/session_graph.hpp"
#include "modules/pose_graph/tree_letters.hpp"

namespace km {

/// An edge from a pose of this robot to one that does not move.
struct HeldEdge {
  PoseEdge edge;
  SE3 T_world_other = SE3::Identity();
};

/// What one robot contributes to the equations of its team.
struct FrontGraph {
  RobotId self = 0;
  Eigen::Index poses = 0;
  int dimension = 3;                 ///< 2: poses and measurements are planar.
  std::vector<PoseEdge> edges = {};  ///< One end at least is of this robot.
  std::vector<HeldEdge> held = {};
  std::vector<VerticalPrior> verticals = {};
  /// Own poses that others may be told of.
  std::set<KeyframeIndex> open = {};
  /// By how many robots' edges an own pose is touched, this one included; others: by this one.
  std::map<KeyframeIndex, std::uint32_t> touched_by = {};
  bool root = false;  ///< Of the tree: nobody is above to leave poses to.
  /// The root of a team to which nothing is held solves for all but one pose.
  bool free = true;
};

/// One robot's front in the Newton equations of a team, eliminated up a tree of robots:
/// multifrontal Cholesky factorisation (Duff, Reid, ACM TOMS 1983) whose fronts are robots. Each
/// robot adds its children's Schur complements to its own equations, eliminates the poses that no
/// robot outside its subtree touches, and tells its parent what remains. Of these poses, those that
/// are public may also be left to the parent, where eliminating them would couple more poses than
/// it uncouples: then edges between them are told as such (ToldEdge). What is told of a robot's
/// other poses is what they come to on those told, never they themselves.
///
/// Nodes are the own poses in order, then poses of other robots that own edges end on ("followed",
/// too: this robot knows where they are), then those that only children speak of. Not thread-safe.
class TreeFront {
 public:
  /// Throws std::invalid_argument if an edge names a pose that is not there, or has no usable
  /// precision.
  explicit TreeFront(FrontGraph graph);

  /// Own poses and those that own edges end on.
  [[nodiscard]] std::size_t followed() const { return followed_; }
  [[nodiscard]] const KeyframeId& id(std::size_t node) const { return ids_[node]; }
  [[nodiscard]] std::size_t node_of(const KeyframeId& id) const;
  [[nodiscard]] const FrontGraph& graph() const { return graph_; }
  [[nodiscard]] Eigen::Index block() const { return graph_.dimension == 2 ? 3 : 6; }

  /// Weights in [0, 1] of the edges, then of the held ones.
  void weigh(const std::vector<double>& weights);
  /// True if second derivatives with the present weights would differ much from those at hand.
  [[nodiscard]] bool stale() const;

  /// Takes in the system of a child. Throws std::invalid_argument if it does not fit.
  void set_child(RobotId child, TreeSystem system);
  void reweigh_child(RobotId child, std::span<const UpLetter::NewWeight> weights);

  /// Second derivatives of own edges at `poses` (of the followed nodes).
  void linearise(std::span<const SE3> poses, Curvature curvature);
  /// Eliminates what can be. False if that is not positive definite.
  [[nodiscard]] bool factorise();
  /// True if factorise() is due: own or children's equations have changed.
  [[nodiscard]] bool changed() const { return changed_; }

  /// The system left to the parent, after factorise().
  [[nodiscard]] TreeSystem told_system(std::span<const SE3> poses);
  /// Weights of told edges that have changed much since they were told; they count as told.
  [[nodiscard]] std::vector<UpLetter::NewWeight> told_weights();

  /// Forward substitution of own slopes at `poses` and of the children's right-hand sides.
  /// Throws std::invalid_argument if one of these has another size than its system.
  void reduce(std::span<const SE3> poses, const std::map<RobotId, Eigen::VectorXd>& children);
  /// Of the poses left to the parent.
  [[nodiscard]] Eigen::VectorXd reduced() const;
  /// Squared norm of the others' rows.
  [[nodiscard]] double decrement() const { return decrement_; }

  /// At the root: what the poses left (none, or one) move by, and the decrement that adds.
  struct RootStep {
    Eigen::VectorXd kept;
    double decrement = 0.0;
  };
  [[nodiscard]] RootStep solve_root(bool upright) const;
  /// Back substitution: from the step of the poses left to the parent to those of all nodes, one
  /// column each.
  [[nodiscard]] Eigen::MatrixXd substitute_back(const Eigen::VectorXd& kept) const;
  /// A child's part of these.
  [[nodiscard]] Eigen::VectorXd step_of_child(RobotId child, const Eigen::MatrixXd& steps) const;

  /// Of own edges with a weight, held ones and verticals.
  [[nodiscard]] double cost(std::span<const SE3> poses) const;

 private:
  struct Edge {  // between nodes
    BlockEdge measured;
    int pair = -1;
    bool transposed = false;
    int told = -1;  // place among the told edges, if both its ends are left to the parent
  };
  struct Child {
    TreeSystem system;
    std::vector<int> node = {};  // of its variables
    std::vector<int> pair = {};  // of its pairs, in the plan
    std::vector<bool> transposed = {};
    std::vector<int> told = {};  // of its edges: place among the told ones here, or -1
  };
  struct ToldWeight {
    RobotId child = 0;  // self: an own edge
    std::size_t edge = 0;
    float told = 0.0F;
  };

  int add_node(const KeyframeId& id);
  void plan();
  [[nodiscard]] std::vector<bool> incomplete() const;
  void list_told_edges();
  void add_child(const Child& child, BlockMatrix& A) const;
  void add_slopes(std::span<const SE3> poses, Eigen::MatrixXd& C) const;
  [[nodiscard]] float weight_of(const ToldWeight& told) const;
  template <int kBlock>
  void add_own(std::span<const SE3> poses, Curvature curvature, BlockMatrix& A) const;

  FrontGraph graph_;
  std::vector<KeyframeId> ids_;
  std::map<KeyframeId, int> foreign_;  // nodes that are not own poses
  std::size_t followed_ = 0;
  std::vector<Edge> edges_;
  std::vector<double> weights_;             // of edges_, then of the held ones
  std::vector<double> linearised_weights_;  // of edges that are not told
  std::map<RobotId, Child> children_;
  std::shared_ptr<const EliminationPlan> plan_;
  std::optional<FrontalCholesky> factor_;
  BlockMatrix own_;
  Curvature curvature_ = Curvature::kGaussNewton;
  std::vector<ToldWeight> told_;
  bool changed_ = true;
  Eigen::MatrixXd forwarded_;
  double decrement_ = 0.0;
};

/// The step of one pose, of 3 or 6 entries, as a tangent vector of SE(3): planar steps are
/// [w_z; v_x; v_y].
[[nodiscard]] Vector6 tangent_of_step(const Eigen::Ref<const Eigen::VectorXd>& step);

/// sqrt of the cost of an edge with weight 1 [sigma]: for small Gaussian noise with these
/// precisions its square is chi-squared.
[[nodiscard]] double residual_of(const PoseEdge& edge, const SE3& T_world_from,
                                 const SE3& T_world_to);

}  // namespace km
