#include <catch2/catch.hpp>
#include <numbers>
#include <random>

#include "modules/core/lie.hpp"
#include "modules/mesh_deformation/deformation_terms.hpp"
#include "test/support/numeric_jacobian.hpp"
#include "test/support/random_pose.hpp"

namespace km {
namespace {

constexpr double kExact = 1e-12;  // [m] of numbers of size one

const Eigen::Matrix3d kHalfTurn =
    Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()).toRotationMatrix();

SE3 at(double x, double y, double z) {
  return make_pose(Eigen::Matrix3d::Identity(), {x, y, z});
}

constexpr double kDerivative = 1e-5;  // central differences of step 1e-6, values up to 10

Eigen::Vector3d rigidity(const SE3& T_a0, const Eigen::Vector3d& p_b0, const SE3& T_a,
                         const Eigen::Vector3d& p_b) {
  return rigidity_term(T_a, T_a0.inverse() * p_b0, at(p_b.x(), p_b.y(), p_b.z())).residual;
}

}  // namespace

TEST_CASE("Rigidity is how far a node is from where its neighbour puts it", "[mesh_deformation]") {
  SECTION("a neighbour that stayed and a node that moved") {
    CHECK(rigidity(SE3::Identity(), {1, 1, 1}, SE3::Identity(), {2, 1, 1})
              .isApprox(Eigen::Vector3d(-1, 0, 0), kExact));
  }
  SECTION("a neighbour turned by 180 degrees") {
    const SE3 turned = make_pose(kHalfTurn, Eigen::Vector3d::Zero());
    CHECK(rigidity(SE3::Identity(), {1, 1, 1}, turned, {1, 1, 1})
              .isApprox(Eigen::Vector3d(-2, -2, 0), kExact));
  }
  SECTION("a neighbour that was turned to begin with") {
    const SE3 before = make_pose(kHalfTurn, {1, 0, 0});
    CHECK(rigidity(before, {1, 1, 1}, before, {1, 1, 1}).norm() < kExact);
    CHECK(rigidity(before, {1, 1, 1}, at(1, 0, 0), {1, 1, 1})
              .isApprox(Eigen::Vector3d(0, -2, 0), kExact));
  }
}

TEST_CASE("The derivatives of rigidity are those of differences", "[mesh_deformation]") {
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

TEST_CASE("A node that turns with its keyframe has no rotation residual", "[mesh_deformation]") {
  std::mt19937 rng(3);
  const SE3 T_odom_kf = random_pose(rng);
  const SE3 T_world_odom = random_pose(rng);
  const SE3 node = make_pose(T_world_odom.linear(), random_vector<3>(rng));
  CHECK(rotation_term(T_odom_kf.linear(), T_world_odom * T_odom_kf, node).residual.norm() < kExact);
}

TEST_CASE("The derivatives of the rotation term are those of differences", "[mesh_deformation]") {
  const auto seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const Eigen::Matrix3d R_odom_kf = random_pose(rng).linear();
  const SE3 keyframe = random_pose(rng);
  // Up to 2 rad: the logarithm turns over at pi.
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

TEST_CASE("The anchor term is the tangent vector from the anchor", "[mesh_deformation]") {
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
