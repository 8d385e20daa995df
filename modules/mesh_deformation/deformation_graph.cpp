#include "modules/mesh_deformation/deformation_graph.hpp"

#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <deque>
#include <memory>
#include <utility>

#include "modules/core/geometry/lie.hpp"

namespace km {
namespace {

// Appends edges between `node` and `count` keyframes spread evenly from `first` to `last`, both
// included, or all of these keyframes if there are fewer. One edge is to `first`.
void append_edges(KeyframeIndex first, KeyframeIndex last, std::size_t count, std::uint32_t node,
                  std::vector<KeyframeEdge>& keyframe_edges) {
  const std::size_t steps = std::min<std::size_t>(count - 1, last - first);
  if (steps == 0) {
    keyframe_edges.push_back({first, node});
    return;
  }
  for (std::size_t i = 0; i <= steps; ++i)
    keyframe_edges.push_back(
        {first + static_cast<KeyframeIndex>((last - first) * i / steps), node});
}

// Motion of surface that is rigidly attached to a keyframe, when the keyframe moves from pose
// `from` to pose `to`.
SE3 rigid_motion(const SE3& to, const SE3& from) {
  return to * from.inverse();
}

// First keyframe edge of every node; keyframe_edges.size() if it has none.
std::vector<std::size_t> first_keyframe_edges(const DeformationGraph& graph) {
  std::vector<std::size_t> first(graph.nodes.size(), graph.keyframe_edges.size());
  for (std::size_t i = graph.keyframe_edges.size(); i-- > 0;)
    first[graph.keyframe_edges[i].node] = i;
  return first;
}

// The terms for Ceres. A pose block is a quaternion x, y, z, w, then a translation. Costs return
// derivatives by the six tangent coordinates in the first six of the seven columns of a block,
// which PlusJacobian of the manifold selects.

using GraphPose = std::array<double, 7>;

GraphPose to_graph_pose(const SE3& T) {
  const Eigen::Quaterniond q(T.linear());
  const auto& t = T.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

SE3 from_graph_pose(const double* block) {
  const Eigen::Map<const Eigen::Quaterniond> q(block);
  return make_pose(q.toRotationMatrix(), Eigen::Map<const Eigen::Vector3d>(block + 4));
}

// retract() and local_coordinates() on pose blocks.
class GraphPoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const GraphPose moved =
        to_graph_pose(retract(from_graph_pose(x), Eigen::Map<const Vector6>(delta)));
    std::copy(moved.begin(), moved.end(), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6>{y_minus_x} = local_coordinates(from_graph_pose(x), from_graph_pose(y));
    return true;
  }
  bool MinusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

using Jacobian67 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

// Rows of two 3 x 6 derivatives, one above the other, with a zero seventh column.
void store(double* jacobian, const Matrix36& upper, const Matrix36& lower) {
  Eigen::Map<Jacobian67> J(jacobian);
  J.topLeftCorner<3, 6>() = upper;
  J.bottomLeftCorner<3, 6>() = lower;
  J.col(6).setZero();
}

// Rigidity between two nodes, in both directions. Blocks: node k, node l.
class MeshEdgeCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  // `offset`: g_l - g_k [m]; `weight`: 1 / sigma [1/m].
  MeshEdgeCost(const Eigen::Vector3d& offset, double weight) : offset_(offset), weight_(weight) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const SE3 k = from_graph_pose(parameters[0]);
    const SE3 l = from_graph_pose(parameters[1]);
    const RigidityTerm forth = rigidity_term(k, offset_, l);
    const RigidityTerm back = rigidity_term(l, -offset_, k);
    Eigen::Map<Vector6> r(residuals);
    r << weight_ * forth.residual, weight_ * back.residual;
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) store(jacobians[0], weight_ * forth.by_a, weight_ * back.by_b);
    if (jacobians[1] != nullptr) store(jacobians[1], weight_ * forth.by_b, weight_ * back.by_a);
    return true;
  }

 private:
  Eigen::Vector3d offset_;
  double weight_;
};

// Rigidity between a keyframe and a node it saw, and their relative rotation. Blocks: keyframe,
// node.
class KeyframeEdgeCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  // Weights are 1 / sigma: [1/m], [1/rad].
  KeyframeEdgeCost(const SE3& T_odom_kf, const Eigen::Vector3d& g_node, double position_weight,
                   double rotation_weight)
      : R_odom_kf_(T_odom_kf.linear()),
        g_kf_(T_odom_kf.inverse() * g_node),
        position_weight_(position_weight),
        rotation_weight_(rotation_weight) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const SE3 keyframe = from_graph_pose(parameters[0]);
    const SE3 node = from_graph_pose(parameters[1]);
    const RigidityTerm position = rigidity_term(keyframe, g_kf_, node);
    const RotationTerm rotation = rotation_term(R_odom_kf_, keyframe, node);
    Eigen::Map<Vector6> r(residuals);
    r << position_weight_ * position.residual, rotation_weight_ * rotation.residual;
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr)
      store(jacobians[0], position_weight_ * position.by_a,
            rotation_weight_ * rotation.by_keyframe);
    if (jacobians[1] != nullptr)
      store(jacobians[1], position_weight_ * position.by_b, rotation_weight_ * rotation.by_node);
    return true;
  }

 private:
  Eigen::Matrix3d R_odom_kf_;
  Eigen::Vector3d g_kf_;  // the node in the keyframe, undeformed
  double position_weight_;
  double rotation_weight_;
};

// Holds a keyframe at its optimised pose. Block: keyframe.
class AnchorCost final : public ceres::SizedCostFunction<6, 7> {
 public:
  AnchorCost(const SE3& anchor, double rotation_weight, double translation_weight)
      : anchor_(anchor),
        rotation_weight_(rotation_weight),
        translation_weight_(translation_weight) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const AnchorTerm term = anchor_term(anchor_, from_graph_pose(parameters[0]));
    Eigen::Map<Vector6> r(residuals);
    r << rotation_weight_ * term.residual.head<3>(), translation_weight_ * term.residual.tail<3>();
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    store(jacobians[0], rotation_weight_ * term.by_pose.topRows<3>(),
          translation_weight_ * term.by_pose.bottomRows<3>());
    return true;
  }

 private:
  SE3 anchor_;
  double rotation_weight_;
  double translation_weight_;
};

// Standard deviation of a node's rotation against a keyframe that saw it. The term is weak: it
// determines the rotation to 30 degrees. An edge to a neighbour at half a metre determines it to 6
// degrees, with the default mesh_edge_m.
constexpr double kRotationNoise_rad = 0.5;

// The solver stops when a step changes the poses by less than this share of their size. The share
// is far below the resolution of a mesh in floats.
constexpr double kParameterTolerance = 1e-10;

// The problem with its poses and costs, to which Ceres only refers.
class GraphProblem {
 public:
  GraphProblem(const DeformationGraph& graph, std::span<const SE3> anchors,
               const DeformationNoise& noise, const DeformationPoses& initial)
      : problem_(options()) {
    for (const SE3& T : initial.T_world_kf) keyframes_.push_back(to_graph_pose(T));
    for (const SE3& T : initial.T_world_node) nodes_.push_back(to_graph_pose(T));
    add_keyframe_edges(graph, noise);
    add_edges(graph, noise);
    add_anchors(anchors, noise);
  }

  ceres::Problem& problem() { return problem_; }

  // Keyframes first, nodes last.
  [[nodiscard]] std::shared_ptr<ceres::ParameterBlockOrdering> elimination_order() {
    auto order = std::make_shared<ceres::ParameterBlockOrdering>();
    for (std::size_t i = 0; i < keyframes_.size(); ++i)
      if (has_edge_[i]) order->AddElementToGroup(keyframes_[i].data(), 0);
    for (GraphPose& node : nodes_)
      if (problem_.HasParameterBlock(node.data())) order->AddElementToGroup(node.data(), 1);
    return order;
  }

  [[nodiscard]] DeformationPoses poses() const {
    DeformationPoses poses;
    for (const GraphPose& block : keyframes_)
      poses.T_world_kf.push_back(from_graph_pose(block.data()));
    for (const GraphPose& block : nodes_)
      poses.T_world_node.push_back(from_graph_pose(block.data()));
    return poses;
  }

 private:
  static ceres::Problem::Options options() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    return options;
  }

  void add_pose(GraphPose& block) { problem_.AddParameterBlock(block.data(), 7, &manifold_); }

  void add_keyframe_edges(const DeformationGraph& graph, const DeformationNoise& noise) {
    has_edge_.assign(keyframes_.size(), false);
    for (const KeyframeEdge& keyframe_edge : graph.keyframe_edges) {
      keyframe_edges_.emplace_back(graph.T_odom_kf[keyframe_edge.keyframe],
                                   graph.nodes[keyframe_edge.node], 1.0 / noise.keyframe_edge_m,
                                   1.0 / kRotationNoise_rad);
      GraphPose& keyframe = keyframes_[keyframe_edge.keyframe];
      has_edge_[keyframe_edge.keyframe] = true;
      add_pose(keyframe);
      add_pose(nodes_[keyframe_edge.node]);
      problem_.AddResidualBlock(&keyframe_edges_.back(), nullptr, keyframe.data(),
                                nodes_[keyframe_edge.node].data());
    }
  }

  void add_edges(const DeformationGraph& graph, const DeformationNoise& noise) {
    for (const auto& [k, l] : graph.edges) {
      edges_.emplace_back(graph.nodes[l] - graph.nodes[k], 1.0 / noise.mesh_edge_m);
      add_pose(nodes_[k]);
      add_pose(nodes_[l]);
      problem_.AddResidualBlock(&edges_.back(), nullptr, nodes_[k].data(), nodes_[l].data());
    }
  }

  void add_anchors(std::span<const SE3> anchors, const DeformationNoise& noise) {
    for (std::size_t i = 0; i < anchors.size(); ++i) {
      if (!has_edge_[i]) {
        keyframes_[i] = to_graph_pose(anchors[i]);
        continue;
      }
      anchors_.emplace_back(anchors[i], 1.0 / noise.anchor_rotation_rad,
                            1.0 / noise.anchor_translation_m);
      problem_.AddResidualBlock(&anchors_.back(), nullptr, keyframes_[i].data());
    }
  }

  GraphPoseManifold manifold_;
  std::vector<GraphPose> keyframes_;
  std::vector<GraphPose> nodes_;
  std::vector<bool> has_edge_;
  // Costs must not move in memory.
  std::deque<KeyframeEdgeCost> keyframe_edges_;
  std::deque<MeshEdgeCost> edges_;
  std::deque<AnchorCost> anchors_;
  ceres::Problem problem_;  // last member: destroyed first
};

ceres::Solver::Options solver_options(const DeformationStop& stop) {
  ceres::Solver::Options options;
  // Keyframes are connected only through nodes. They are eliminated, and conjugate gradients solve
  // the rest to the accuracy (eta) that a step can use. Sparse Cholesky factors take ten times as
  // long.
  options.linear_solver_type = ceres::ITERATIVE_SCHUR;
  options.preconditioner_type = ceres::SCHUR_JACOBI;
  options.max_linear_solver_iterations = 200;
  options.max_num_iterations = stop.max_iterations;
  options.function_tolerance = stop.energy_tolerance;
  options.parameter_tolerance = kParameterTolerance;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

DeformationStatus status_of(ceres::TerminationType termination) {
  switch (termination) {
    case ceres::CONVERGENCE:
      return DeformationStatus::kConverged;
    case ceres::NO_CONVERGENCE:
      return DeformationStatus::kIterationLimit;
    default:
      return DeformationStatus::kFailed;
  }
}

}  // namespace

RigidityTerm rigidity_term(const SE3& T_world_a, const Eigen::Vector3d& point_a,
                           const SE3& T_world_b) {
  RigidityTerm term;
  term.residual = T_world_a * point_a - T_world_b.translation();
  term.by_a.leftCols<3>() = -T_world_a.linear() * skew(point_a);
  term.by_a.rightCols<3>() = T_world_a.linear();
  term.by_b.leftCols<3>().setZero();
  term.by_b.rightCols<3>() = -T_world_b.linear();
  return term;
}

RotationTerm rotation_term(const Eigen::Matrix3d& R_odom_kf, const SE3& T_world_kf,
                           const SE3& T_world_node) {
  const Eigen::Matrix3d R_kf_node = T_world_kf.linear().transpose() * T_world_node.linear();
  RotationTerm term;
  term.residual = so3_log(R_odom_kf * R_kf_node);
  const Eigen::Matrix3d J_r_inverse = so3_right_jacobian_inverse(term.residual);
  term.by_node.leftCols<3>() = J_r_inverse;
  term.by_node.rightCols<3>().setZero();
  // R_kf_node is perturbed by exp(-d) from the left, which equals exp(-R_kf_node^T d) from the
  // right.
  term.by_keyframe.leftCols<3>() = -J_r_inverse * R_kf_node.transpose();
  term.by_keyframe.rightCols<3>().setZero();
  return term;
}

AnchorTerm anchor_term(const SE3& anchor, const SE3& pose) {
  const Eigen::Matrix3d R_anchor_pose = anchor.linear().transpose() * pose.linear();
  AnchorTerm term;
  term.residual = local_coordinates(anchor, pose);
  term.by_pose.setZero();
  term.by_pose.topLeftCorner<3, 3>() = so3_right_jacobian_inverse(term.residual.head<3>());
  term.by_pose.bottomRightCorner<3, 3>() = R_anchor_pose;
  return term;
}

std::vector<KeyframeEdge> choose_keyframe_edges(std::span<const MeshNode> nodes,
                                                std::size_t keyframes_per_node,
                                                KeyframeIndex max_gap_keyframes) {
  std::vector<KeyframeEdge> keyframe_edges;
  keyframe_edges.reserve(nodes.size() * keyframes_per_node);
  for (std::uint32_t n = 0; n < nodes.size(); ++n) {
    const auto [first, last] = nodes[n].seen_by;
    if (last - first <= max_gap_keyframes || keyframes_per_node == 1) {
      append_edges(first, last, keyframes_per_node, n, keyframe_edges);
    } else {
      keyframe_edges.push_back({first, n});
      keyframe_edges.push_back({last, n});
    }
  }
  return keyframe_edges;
}

const char* to_string(DeformationStatus status) {
  constexpr std::array kNames = {"converged", "iteration limit", "failed"};  // as the enumerators
  return kNames.at(static_cast<std::size_t>(status));
}

DeformationPoses initial_poses(const DeformationGraph& graph, std::span<const SE3> T_world_kf) {
  DeformationPoses poses;
  poses.T_world_kf.assign(T_world_kf.begin(), T_world_kf.end());
  std::vector<SE3> T_world_odom;
  T_world_odom.reserve(T_world_kf.size());
  for (std::size_t i = 0; i < T_world_kf.size(); ++i)
    T_world_odom.push_back(rigid_motion(T_world_kf[i], graph.T_odom_kf[i]));

  std::vector<Eigen::Vector3d> sums(graph.nodes.size(), Eigen::Vector3d::Zero());
  std::vector<int> counts(graph.nodes.size(), 0);
  for (const KeyframeEdge& keyframe_edge : graph.keyframe_edges) {
    sums[keyframe_edge.node] +=
        T_world_odom[keyframe_edge.keyframe] * graph.nodes[keyframe_edge.node];
    ++counts[keyframe_edge.node];
  }
  const std::vector<std::size_t> first = first_keyframe_edges(graph);
  poses.T_world_node.reserve(graph.nodes.size());
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    if (counts[n] == 0) {
      poses.T_world_node.push_back(make_pose(Eigen::Matrix3d::Identity(), graph.nodes[n]));
      continue;
    }
    const KeyframeIndex keyframe = graph.keyframe_edges[first[n]].keyframe;
    poses.T_world_node.push_back(make_pose(T_world_odom[keyframe].linear(), sums[n] / counts[n]));
  }
  return poses;
}

DeformationSolution solve(const DeformationGraph& graph, std::span<const SE3> T_world_kf,
                          const DeformationNoise& noise, const DeformationStop& stop,
                          DeformationPoses initial) {
  DeformationSolution solution;
  if (graph.keyframe_edges.empty()) {  // no node is held
    solution.poses = std::move(initial);
    solution.poses.T_world_kf.assign(T_world_kf.begin(), T_world_kf.end());
    return solution;
  }
  GraphProblem graph_problem(graph, T_world_kf, noise, initial);
  ceres::Solver::Options options = solver_options(stop);
  options.linear_solver_ordering = graph_problem.elimination_order();
  ceres::Solver::Summary summary;
  ceres::Solve(options, &graph_problem.problem(), &summary);
  solution.status = status_of(summary.termination_type);
  solution.iterations = static_cast<int>(summary.iterations.size()) - 1;
  solution.initial_cost = summary.initial_cost;
  solution.final_cost = summary.final_cost;
  solution.poses =
      solution.status == DeformationStatus::kFailed ? std::move(initial) : graph_problem.poses();
  return solution;
}

}  // namespace km
