#include <ceres/problem.h>
#include <ceres/solver.h>

#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "modules/mesh_deformation/deformation_costs.hpp"
#include "modules/mesh_deformation/deformation_graph.hpp"

namespace km {
namespace {

// Standard deviation of a node's turn against a keyframe that saw it. Weak: neighbours half a metre
// away within 2 cm hold a node's rotation to 2 degrees each, this to 30.
constexpr double kRotationNoise_rad = 0.5;

// Ends when a step changes the poses by less than this share of their own size: far below what a
// mesh in floats can show.
constexpr double kParameterTolerance = 1e-10;

// The problem with its poses and costs, which Ceres only borrows.
class GraphProblem {
 public:
  GraphProblem(const DeformationGraph& graph, std::span<const SE3> anchors,
               const DeformationNoise& noise, const DeformationPoses& initial)
      : problem_(options()) {
    for (const SE3& T : initial.T_world_kf) keyframes_.push_back(to_graph_pose(T));
    for (const SE3& T : initial.T_world_node) nodes_.push_back(to_graph_pose(T));
    add_ties(graph, noise);
    add_edges(graph, noise);
    add_anchors(anchors, noise);
  }

  ceres::Problem& problem() { return problem_; }

  // Keyframes first, nodes last.
  [[nodiscard]] std::shared_ptr<ceres::ParameterBlockOrdering> elimination_order() {
    auto order = std::make_shared<ceres::ParameterBlockOrdering>();
    for (std::size_t i = 0; i < keyframes_.size(); ++i)
      if (tied_[i]) order->AddElementToGroup(keyframes_[i].data(), 0);
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

  void add_ties(const DeformationGraph& graph, const DeformationNoise& noise) {
    tied_.assign(keyframes_.size(), false);
    for (const KeyframeTie& tie : graph.ties) {
      ties_.emplace_back(graph.T_odom_kf[tie.keyframe], graph.nodes[tie.node],
                         1.0 / noise.keyframe_tie_m, 1.0 / kRotationNoise_rad);
      GraphPose& keyframe = keyframes_[tie.keyframe];
      tied_[tie.keyframe] = true;
      add_pose(keyframe);
      add_pose(nodes_[tie.node]);
      problem_.AddResidualBlock(&ties_.back(), nullptr, keyframe.data(), nodes_[tie.node].data());
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
      if (!tied_[i]) {
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
  std::vector<bool> tied_;
  // Costs stay where they are put.
  std::deque<KeyframeTieCost> ties_;
  std::deque<MeshEdgeCost> edges_;
  std::deque<AnchorCost> anchors_;
  ceres::Problem problem_;  // last: goes first
};

ceres::Solver::Options solver_options(const DeformationStop& stop) {
  ceres::Solver::Options options;
  // Keyframes meet in nodes only: they are eliminated, the rest is solved by conjugate gradients to
  // the share of accuracy (eta) that a step can use. Sparse Cholesky factors take ten times as
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

DeformationSolution solve(const DeformationGraph& graph, std::span<const SE3> T_world_kf,
                          const DeformationNoise& noise, const DeformationStop& stop,
                          DeformationPoses initial) {
  DeformationSolution solution;
  if (graph.ties.empty()) {  // nothing pulls
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
