#include "modules/pose_graph/newton/robot_system.hpp"

#include <cmath>

#include "modules/core/lie.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// First entry of a planar step among those of a tangent vector of SE(3): rotation about z and
// translation along x and y stand together.
constexpr Index kPlanarFirst = 2;

Index first_of(Index block) {
  return block == 3 ? kPlanarFirst : 0;
}

template <typename Values>
void add_coupling(BlockMatrix& A, const RobotGraph::Edge& e, const Values& values) {
  if (e.transposed)
    A.between(e.pair) += values.transpose();
  else
    A.between(e.pair) += values;
}

RobotSystem zero_system(const RobotGraph& graph, Index block, Index columns) {
  return {BlockMatrix::zero(block, static_cast<std::size_t>(graph.nodes()),
                            graph.plan()->pairs().size()),
          MatrixXd::Zero(block * graph.nodes(), columns)};
}

const SE3& pose(std::span<const SE3> poses, Index node) {
  return poses[static_cast<std::size_t>(node)];
}

template <int kBlock>
void add_slope(RobotSystem& system, const RobotGraph::Edge& e, const EdgeModel& model) {
  constexpr Index kFirst = kBlock == 3 ? kPlanarFirst : 0;
  system.cost += model.cost;
  system.C.middleRows<kBlock>(kBlock * e.i) -= model.g_i.segment<kBlock>(kFirst);
  system.C.middleRows<kBlock>(kBlock * e.j) -= model.g_j.segment<kBlock>(kFirst);
}

template <int kBlock>
void add_model(RobotSystem& system, const RobotGraph::Edge& e, const EdgeModel& model) {
  constexpr Index kFirst = kBlock == 3 ? kPlanarFirst : 0;
  add_slope<kBlock>(system, e, model);
  system.A.diagonal.middleCols<kBlock>(kBlock * e.i) +=
      model.H_ii.block<kBlock, kBlock>(kFirst, kFirst);
  system.A.diagonal.middleCols<kBlock>(kBlock * e.j) +=
      model.H_jj.block<kBlock, kBlock>(kFirst, kFirst);
  add_coupling(system.A, e, model.H_ij.block<kBlock, kBlock>(kFirst, kFirst));
}

void add_slope(RobotSystem& system, const RobotGraph::Edge& e, const EdgeModel& model,
               Index block) {
  block == 3 ? add_slope<3>(system, e, model) : add_slope<6>(system, e, model);
}

void add_model(RobotSystem& system, const RobotGraph::Edge& e, const EdgeModel& model,
               Index block) {
  block == 3 ? add_model<3>(system, e, model) : add_model<6>(system, e, model);
}

// Planar poses stand upright as they are.
std::span<const VerticalPrior> verticals(const RobotGraph& graph, int dimension) {
  if (dimension == 2) return {};
  return graph.verticals();
}

void add_slope(RobotSystem& system, const VerticalPrior& prior, const VerticalModel& model) {
  system.cost += model.cost;
  system.C.middleRows<3>(6 * prior.pose) -= model.g;
}

void add_verticals(RobotSystem& system, const RobotGraph& graph, std::span<const SE3> poses,
                   int dimension, Curvature curvature) {
  for (const VerticalPrior& v : verticals(graph, dimension)) {
    const VerticalModel model = model_vertical(v, pose(poses, v.pose).linear(), curvature);
    add_slope(system, v, model);
    system.A.diagonal.block<3, 3>(0, 6 * v.pose) += model.H;
  }
}

}  // namespace

RobotSystem newton_system(const RobotGraph& graph, std::span<const SE3> poses, int dimension,
                          Curvature curvature) {
  RobotSystem system = zero_system(graph, tangent_size(dimension), 1);
  for (const RobotGraph::Edge& e : graph.edges())
    add_model(system, e, model_edge(e, pose(poses, e.i), pose(poses, e.j), curvature),
              tangent_size(dimension));
  add_verticals(system, graph, poses, dimension, curvature);
  return system;
}

RobotSystem eliminated_system(const RobotGraph& graph, std::span<const SE3> poses, int dimension,
                              Curvature curvature) {
  const Index block = tangent_size(dimension);
  RobotSystem system = zero_system(graph, block, 1);
  EdgeModel slope;
  for (const RobotGraph::Edge& e : graph.edges()) {
    if (e.kept_pair < 0) {
      add_model(system, e, model_edge(e, pose(poses, e.i), pose(poses, e.j), curvature), block);
    } else {
      slope_edge(e, pose(poses, e.i), pose(poses, e.j), slope);
      add_slope(system, e, slope, block);
    }
  }
  add_verticals(system, graph, poses, dimension, curvature);
  return system;
}

std::vector<KeptEdge> kept_edges(const RobotGraph& graph, std::span<const SE3> poses) {
  std::vector<KeptEdge> edges;
  for (const RobotGraph::Edge& e : graph.edges())
    if (e.kept_pair >= 0)
      edges.push_back(
          {e.kept_pair, e.transposed, static_cast<float>(e.kappa), static_cast<float>(e.tau),
           SinglePose::of(pose(poses, e.i).inverse() * pose(poses, e.j)), SinglePose::of(e.T_i_j)});
  return edges;
}

RobotSystem newton_slope(const RobotGraph& graph, std::span<const SE3> poses, int dimension) {
  RobotSystem system{{}, MatrixXd::Zero(tangent_size(dimension) * graph.nodes(), 1)};
  EdgeModel model;
  for (const RobotGraph::Edge& e : graph.edges()) {
    slope_edge(e, pose(poses, e.i), pose(poses, e.j), model);
    add_slope(system, e, model, tangent_size(dimension));
  }
  for (const VerticalPrior& v : verticals(graph, dimension))
    add_slope(system, v, model_vertical(v, pose(poses, v.pose).linear(), Curvature::kGaussNewton));
  return system;
}

RobotSystem rotation_system(const RobotGraph& graph, int dimension) {
  RobotSystem system = zero_system(graph, dimension, dimension);
  for (const RobotGraph::Edge& e : graph.edges()) {
    system.A.at(static_cast<int>(e.i)).diagonal().array() += e.kappa;
    system.A.at(static_cast<int>(e.j)).diagonal().array() += e.kappa;
    const MatrixXd R = e.T_i_j.linear().topLeftCorner(dimension, dimension);
    add_coupling(system.A, e, -e.kappa * R);
  }
  return system;
}

RobotSystem translation_system(const RobotGraph& graph, std::span<const SE3> poses, int dimension) {
  RobotSystem system = zero_system(graph, 1, dimension);
  for (const RobotGraph::Edge& e : graph.edges()) {
    system.A.diagonal(0, e.i) += e.tau;
    system.A.diagonal(0, e.j) += e.tau;
    system.A.coupling(0, e.pair) -= e.tau;
    const Eigen::Vector3d moved = e.tau * (pose(poses, e.i).linear() * e.T_i_j.translation());
    system.C.row(e.i) -= moved.head(dimension).transpose();
    system.C.row(e.j) += moved.head(dimension).transpose();
  }
  return system;
}

Vector6 tangent_of(const Eigen::Ref<const Eigen::VectorXd>& step) {
  Vector6 xi = Vector6::Zero();
  xi.segment(first_of(step.size()), step.size()) = step;
  return xi;
}

Eigen::VectorXd step_of(const Vector6& xi, Index block) {
  return xi.segment(first_of(block), block);
}

Eigen::Matrix3d rotation_of(const Eigen::Ref<const MatrixXd>& X) {
  if (X.rows() == 3) return nearest_rotation(X.transpose());
  const double angle = std::atan2(X(0, 1) - X(1, 0), X(0, 0) + X(1, 1));
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace km
