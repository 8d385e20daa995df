#include "modules/core/geometry/lie.hpp"
#include "modules/mesh_deformation/deformation_graph.hpp"
#include "test/support/numeric_jacobian.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr DeformationStop kStop{.max_iterations = 50, .energy_tolerance = 1e-14};

constexpr double kDerivative = 1e-5;  // central differences of step 1e-6, values up to 10

}  // namespace

TEST_CASE("A node is tied to keyframes spread over its time of sight") {
  const auto keyframes = [](SeenBy seen, std::size_t count) {
    std::vector<KeyframeIndex> result;
    const MeshNode node{Eigen::Vector3d::Zero(), seen};
    for (const KeyframeEdge& keyframe_edge : choose_keyframe_edges(std::span(&node, 1), count, 20))
      result.push_back(keyframe_edge.keyframe);
    return result;
  };
  using List = std::vector<KeyframeIndex>;
  CHECK(keyframes({7, 7}, 4) == List{7});
  CHECK(keyframes({7, 9}, 4) == List{7, 8, 9});
  CHECK(keyframes({10, 19}, 4) == List{10, 13, 16, 19});
  CHECK(keyframes({10, 19}, 1) == List{10});
  // Left and seen again: only the ends are known to see the node.
  CHECK(keyframes({10, 100}, 4) == List{10, 100});
}

TEST_CASE("A cube held at two corners stretches") {
  DeformationGraph graph;
  for (int i = 0; i < 8; ++i) graph.nodes.emplace_back(i % 2, i / 2 % 2, i / 4);
  for (std::uint32_t i = 0; i < 8; ++i)
    for (const std::uint32_t bit : {1U, 2U, 4U})
      if ((i & bit) == 0) graph.edges.push_back({i, i | bit});
  graph.T_odom_kf = {make_pose(Eigen::Matrix3d::Identity(), {0, 0, 0})};
  graph.keyframe_edges = {{0, 0}};
  std::vector<SE3> anchors = {make_pose(Eigen::Matrix3d::Identity(), {-0.5, 0, 0})};
  // Held stiffly compared with the edges.
  const DeformationNoise noise{.anchor_rotation_rad = 1e-5,
                               .anchor_translation_m = 1e-5,
                               .mesh_edge_m = 0.1,
                               .keyframe_edge_m = 1e-5};
  graph.T_odom_kf.push_back(make_pose(Eigen::Matrix3d::Identity(), {1, 0, 0}));
  graph.keyframe_edges.push_back({1, 1});
  anchors.push_back(make_pose(Eigen::Matrix3d::Identity(), {1.5, 0, 0}));
  const auto solution = solve(graph, anchors, noise, kStop, initial_poses(graph, graph.T_odom_kf));
  const auto& nodes = solution.poses.T_world_node;
  CHECK(nodes[0].translation().x() == Approx(-0.5).margin(1e-3));
  CHECK(nodes[1].translation().x() == Approx(1.5).margin(1e-3));
  // The far edge is longer than before, but shorter than the held one; all is symmetric.
  const double far = nodes[7].translation().x() - nodes[6].translation().x();
  CHECK(far > 1.0);
  CHECK(far < 2.0);
  CHECK(nodes[7].translation().x() + nodes[6].translation().x() == Approx(1.0).margin(1e-3));
}

TEST_CASE("The derivatives of rigidity agree with differences") {
  const auto seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SE3 a = random_pose(rng, 3.0);
  const SE3 b = random_pose(rng, 3.0);
  const Eigen::Vector3d point = random_vector<3>(rng);
  const RigidityTerm term = rigidity_term(a, point, b);
  const Matrix36 by_a = numeric_jacobian<6>(
      [&](const Vector6& d) { return rigidity_term(retract(a, d), point, b).residual; });
  const Matrix36 by_b = numeric_jacobian<6>(
      [&](const Vector6& d) { return rigidity_term(a, point, retract(b, d)).residual; });
  CHECK((term.by_a - by_a).cwiseAbs().maxCoeff() < kDerivative);
  CHECK((term.by_b - by_b).cwiseAbs().maxCoeff() < kDerivative);
}

TEST_CASE("The derivatives of the rotation term agree with differences") {
  const auto seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Eigen::Matrix3d R_odom_kf = random_pose(rng).linear();
  const SE3 keyframe = random_pose(rng);
  // Up to 2 rad: the logarithm is discontinuous at pi.
  const Eigen::Vector3d turn = 2.0 * random_vector<3>(rng).normalized();
  const SE3 node =
      make_pose(keyframe.linear() * R_odom_kf.transpose() * so3_exp(turn), random_vector<3>(rng));
  const RotationTerm term = rotation_term(R_odom_kf, keyframe, node);
  const Matrix36 by_keyframe = numeric_jacobian<6>([&](const Vector6& d) {
    return rotation_term(R_odom_kf, retract(keyframe, d), node).residual;
  });
  const Matrix36 by_node = numeric_jacobian<6>([&](const Vector6& d) {
    return rotation_term(R_odom_kf, keyframe, retract(node, d)).residual;
  });
  CHECK((term.by_keyframe - by_keyframe).cwiseAbs().maxCoeff() < kDerivative);
  CHECK((term.by_node - by_node).cwiseAbs().maxCoeff() < kDerivative);
}

TEST_CASE("The anchor term is the tangent vector from the anchor") {
  const auto seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SE3 anchor = random_pose(rng);
  Vector6 delta;
  delta << 2.0 * random_vector<3>(rng).normalized(), random_vector<3>(rng);
  const SE3 pose = retract(anchor, delta);
  const AnchorTerm term = anchor_term(anchor, pose);
  CHECK((term.residual - delta).norm() < 1e-9);  // metres of ten, through rotations
  const Matrix6 by_pose = numeric_jacobian<6>(
      [&](const Vector6& d) { return anchor_term(anchor, retract(pose, d)).residual; });
  CHECK((term.by_pose - by_pose).cwiseAbs().maxCoeff() < kDerivative);
}

}  // namespace km
