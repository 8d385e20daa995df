// Ceres' logging defines CHECK too: it must come first and give the name up.
#include "modules/vio/residuals/imu_cost.hpp"
#include "modules/vio/residuals/pose_block.hpp"
#include "modules/vio/residuals/prior_cost.hpp"
#include "modules/vio/residuals/reprojection_cost.hpp"
#undef CHECK
#include <catch2/catch.hpp>

#include "synthetic_motion.hpp"

namespace km {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A cost function at a point. Blocks of seven are poses, moved by their manifold.
struct Evaluation {
  const ceres::CostFunction& cost;
  std::vector<std::vector<double>> blocks;

  Eigen::VectorXd residual() const {
    Eigen::VectorXd r(cost.num_residuals());
    std::vector<const double*> pointers;
    for (const auto& block : blocks) pointers.push_back(block.data());
    REQUIRE(cost.Evaluate(pointers.data(), r.data(), nullptr));
    return r;
  }

  RowMatrix analytic(std::size_t b) const {
    std::vector<const double*> pointers;
    for (const auto& block : blocks) pointers.push_back(block.data());
    RowMatrix J(cost.num_residuals(), static_cast<int>(blocks[b].size()));
    std::vector<double*> jacobians(blocks.size(), nullptr);
    jacobians[b] = J.data();
    Eigen::VectorXd r(cost.num_residuals());
    REQUIRE(cost.Evaluate(pointers.data(), r.data(), jacobians.data()));
    return J.leftCols(blocks[b].size() == 7 ? 6 : J.cols());
  }

  RowMatrix numeric(std::size_t b) {
    constexpr double kStep = 1e-6;
    const std::vector<double> at = blocks[b];
    const int columns = at.size() == 7 ? 6 : static_cast<int>(at.size());
    const auto moved = [&](int column, double step) {
      Eigen::VectorXd delta = Eigen::VectorXd::Zero(columns);
      delta(column) = step;
      if (at.size() == 7)
        REQUIRE(PoseManifold().Plus(at.data(), delta.data(), blocks[b].data()));
      else
        blocks[b][static_cast<std::size_t>(column)] = at[static_cast<std::size_t>(column)] + step;
      const Eigen::VectorXd r = residual();
      blocks[b] = at;
      return r;
    };
    RowMatrix J(cost.num_residuals(), columns);
    for (int c = 0; c < columns; ++c) J.col(c) = (moved(c, kStep) - moved(c, -kStep)) / (2 * kStep);
    return J;
  }

  void check_jacobians(double tolerance) {
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      CAPTURE(b);
      const RowMatrix expected = numeric(b);
      CHECK((analytic(b) - expected).norm() < tolerance * (1.0 + expected.norm()));
    }
  }
};

std::vector<double> values(const PoseBlock& block) {
  return {block.begin(), block.end()};
}
std::vector<double> values(const MotionBlock& block) {
  return {block.begin(), block.end()};
}

OdometryState perturbed(const OdometryState& state, double size, std::mt19937& rng) {
  OdometryState s = state;
  s.T_odom_body = retract(s.T_odom_body, size * random_vector<6>(rng));
  s.v_odom += size * random_vector<3>(rng);
  s.gyro_bias += 0.1 * size * random_vector<3>(rng);
  s.accel_bias += size * random_vector<3>(rng);
  return s;
}

TEST_CASE("The pose manifold's difference undoes its sum", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const PoseBlock x = pose_block(random_pose(rng));
  const Vector6 delta = 0.5 * random_vector<6>(rng);
  PoseBlock y;
  Vector6 back;
  REQUIRE(PoseManifold().Plus(x.data(), delta.data(), y.data()));
  REQUIRE(PoseManifold().Minus(y.data(), x.data(), back.data()));
  CHECK((back - delta).norm() < 1e-12);
}

TEST_CASE("Reprojection Jacobians agree with differences", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 10U));
  const std::size_t camera = GENERATE(0U, 1U);
  CAPTURE(seed, camera);
  std::mt19937 rng(seed);
  const ViewModel view = view_model(synthetic_rig().stereo.cameras[camera], 0.7);
  const SE3 T = random_pose(rng);
  const Eigen::Vector3d p = T * Eigen::Vector3d(3.0, 0.5, -0.4);
  const ReprojectionCost cost(view, Eigen::Vector2d(0.1, -0.2));
  Evaluation evaluation{cost, {values(pose_block(T)), {p.x(), p.y(), p.z()}}};
  evaluation.check_jacobians(1e-6);
}

TEST_CASE("A reprojection error is in standard deviations of the image point", "[vio]") {
  const PinholeCamera camera = synthetic_rig().stereo.cameras[0];
  const ViewModel view = view_model(camera, 0.5);
  const SE3 T = SE3::Identity();
  const Eigen::Vector3d p = camera.T_body_cam * Eigen::Vector3d(0.2, -0.1, 2.0);
  Eigen::Vector2d r;
  REQUIRE(reprojection_error(view, Eigen::Vector2d(0.1, -0.05), T, p, r));
  CHECK(r.norm() < 1e-12);
  REQUIRE(reprojection_error(view, Eigen::Vector2d(0.1 + 1.0 / camera.fx, -0.05), T, p, r));
  CHECK(r.x() == Approx(-2.0));  // 1 px of 0.5 px
  CHECK_FALSE(reprojection_error(view, Eigen::Vector2d::Zero(), T,
                                 camera.T_body_cam * Eigen::Vector3d(0, 0, -1), r));
}

TEST_CASE("With a first estimate only the derivatives are taken there", "[vio]") {
  std::mt19937 rng(3);
  const ViewModel view = view_model(synthetic_rig().stereo.cameras[0], 1.0);
  const SE3 T = random_pose(rng);
  const SE3 T_first = retract(T, 0.05 * random_vector<6>(rng));
  const Eigen::Vector3d p = T * Eigen::Vector3d(3.0, 0.5, -0.4);
  const Eigen::Vector2d bearing(0.1, -0.2);
  const std::vector<double> point{p.x(), p.y(), p.z()};
  const ReprojectionCost plain(view, bearing), held(view, bearing, T_first);
  const Evaluation now{plain, {values(pose_block(T)), point}};
  const Evaluation first{plain, {values(pose_block(T_first)), point}};
  const Evaluation both{held, {values(pose_block(T)), point}};
  CHECK((both.residual() - now.residual()).norm() < 1e-12);
  CHECK((both.analytic(0) - first.analytic(0)).norm() < 1e-9);
  CHECK((both.analytic(1) - first.analytic(1)).norm() < 1e-9);
  CHECK((both.analytic(0) - now.analytic(0)).norm() > 1e-3);
}

TEST_CASE("Inertial Jacobians agree with differences", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 10U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  const SyntheticMotion motion;
  const Stamp from = 100'000'000, to = 400'000'000;
  ImuPreintegration imu(ImuNoise{}, 0.01 * random_vector<3>(rng), 0.05 * random_vector<3>(rng));
  REQUIRE(imu.add(motion.samples(from, to, 5'000'000), from, to));
  const ImuCost cost(ImuFactor(imu, kGravity_mps2));
  const OdometryState i = perturbed(motion.state(from), 0.1, rng);
  const OdometryState j = perturbed(motion.state(to), 0.1, rng);
  Evaluation evaluation{cost,
                        {values(pose_block(i.T_odom_body)), values(motion_block(i)),
                         values(pose_block(j.T_odom_body)), values(motion_block(j))}};
  evaluation.check_jacobians(1e-6);  // entries reach 1e6: relative
}

TEST_CASE("The inertial error of the true motion is zero, whatever the frame", "[vio]") {
  const unsigned seed = GENERATE(range(0U, 5U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  SyntheticMotion motion;
  motion.gyro_bias = 0.02 * random_vector<3>(rng);
  motion.accel_bias = 0.1 * random_vector<3>(rng);
  const Stamp to = 200'000'000;
  ImuPreintegration imu(ImuNoise{}, motion.gyro_bias, motion.accel_bias);
  REQUIRE(imu.add(motion.samples(0, to, 500'000), 0, to));
  const ImuFactor factor(imu, kGravity_mps2);
  OdometryState i = motion.state(0), j = motion.state(to);
  const double standard_deviations = factor.error(i, j).norm();
  CHECK(standard_deviations < 0.01);
  // Heading and position of odom are free.
  const SE3 shift = make_pose(so3_exp(Eigen::Vector3d(0, 0, 1.3)), random_vector<3>(rng));
  for (OdometryState* s : {&i, &j}) {
    s->T_odom_body = shift * s->T_odom_body;
    s->v_odom = shift.linear() * s->v_odom;
  }
  CHECK(factor.error(i, j).norm() == Approx(standard_deviations).margin(1e-6));
}

TEST_CASE("An inertial factor over no time is refused", "[vio]") {
  const ImuPreintegration imu(ImuNoise{}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  CHECK_THROWS_AS(ImuFactor(imu, kGravity_mps2), std::invalid_argument);
}

TEST_CASE("Prior Jacobians agree with differences at the first estimates", "[vio]") {
  std::mt19937 rng(11);
  StatePrior prior;
  for (std::uint64_t k = 0; k < 3; ++k) {
    prior.frames.push_back(k);
    prior.linearization.push_back(perturbed({}, 1.0, rng));
  }
  prior.J = Eigen::MatrixXd(20, prior.dimension());
  for (int c = 0; c < prior.J.cols(); ++c) prior.J.col(c) = random_vector<20>(rng);
  prior.r = random_vector<20>(rng);
  const PriorCost cost(prior);
  std::vector<std::vector<double>> blocks{values(pose_block(prior.linearization[0].T_odom_body)),
                                          values(motion_block(prior.linearization[0]))};
  for (std::size_t k = 1; k < 3; ++k)
    blocks.push_back(values(pose_block(prior.linearization[k].T_odom_body)));
  Evaluation evaluation{cost, blocks};
  CHECK((evaluation.residual() - prior.r).norm() < 1e-12);
  evaluation.check_jacobians(1e-6);
}

}  // namespace
}  // namespace km
