#include "modules/evaluation/trajectory_error.hpp"

#include <catch2/catch.hpp>
#include <numbers>
#include <random>
#include <stdexcept>

#include "modules/evaluation/trajectory_file.hpp"
#include "test/modules/evaluation/trajectories.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

std::vector<StampedPose> moved(std::vector<StampedPose> poses, const SE3& T, double scale = 1.0) {
  for (StampedPose& pose : poses) {
    pose.T.translation() *= scale;
    pose.T = T * pose.T;
  }
  return poses;
}

TeamError error_of(const std::vector<StampedPose>& truth, const std::vector<StampedPose>& estimate,
                   const TrajectoryErrorOptions& options = {}) {
  const TrajectoryInput input{"robot", truth, estimate, {}};
  return trajectory_error({&input, 1}, options);
}

// Corners of a square in the plane, visited in turn. Raised by (+d, -d, +d, -d) they neither
// correlate with x nor y and have mean zero: the best alignment stays the identity.
SE3 corner(int i, double raise) {
  const double x = i % 4 == 0 || i % 4 == 3 ? 1.0 : -1.0;
  const double y = i % 4 < 2 ? 1.0 : -1.0;
  return make_pose(Eigen::Matrix3d::Identity(), {x, y, i % 2 == 0 ? raise : -raise});
}

std::vector<StampedPose> square(double raise) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 8; ++i) poses.push_back({(i + 1) * kSecond, corner(i, raise)});
  return poses;
}

}  // namespace

TEST_CASE("A moved copy of the truth has no error", "[evaluation]") {
  const int seed = GENERATE(range(0, 5));
  CAPTURE(seed);
  std::mt19937 rng(static_cast<unsigned>(seed));
  const auto truth = sample(0.0, 20.0, 400, curve);
  const SE3 T = random_pose(rng);
  const TeamError rigid = error_of(truth, moved(truth, T));
  CHECK(rigid.joint.position_m.count == 400);
  CHECK(rigid.joint.position_m.max < 1e-9);
  CHECK(rigid.joint.rotation_deg.max < 1e-4);  // acos near 1 has half the digits
  CHECK(rigid.joint.rpe_translation_m.max < 1e-9);
  CHECK((rigid.alignment.T_truth_estimate * T).isApprox(SE3::Identity(), 1e-9));
  CHECK(rigid.joint.completeness == Approx(1.0));

  TrajectoryErrorOptions options;
  options.with_scale = true;
  const TeamError similar = error_of(truth, moved(truth, T, 0.25), options);
  CHECK(similar.alignment.scale == Approx(4.0));
  CHECK(similar.joint.position_m.max < 1e-9);
  CHECK(similar.joint.rpe_translation_m.max < 1e-9);
  CHECK(error_of(truth, moved(truth, T, 0.25)).joint.position_m.rmse > 0.1);
}

TEST_CASE("The absolute error of a saddle is its height", "[evaluation]") {
  const TeamError team = error_of(square(0.0), square(0.05));
  CHECK(team.joint.position_m.rmse == Approx(0.05));
  CHECK(team.joint.position_m.mean == Approx(0.05));
  CHECK(team.joint.position_m.median == Approx(0.05));
  CHECK(team.joint.position_m.max == Approx(0.05));
  CHECK(team.joint.rotation_deg.max < 1e-4);
}

TEST_CASE("Relative errors are the drift over the delta", "[evaluation]") {
  // 1 m/s with 2 % too much speed and 0.01 rad/s too much turn.
  const auto truth = sample(0.0, 10.0, 101, [](double t_s) {
    return make_pose(Eigen::Matrix3d::Identity(), {t_s, 0.0, 0.0});
  });
  const auto fast = sample(0.0, 10.0, 101, [](double t_s) {
    return make_pose(Eigen::Matrix3d::Identity(), {1.02 * t_s, 0.0, 0.0});
  });
  const auto turned = sample(0.0, 10.0, 101, [](double t_s) {
    return make_pose(so3_exp({0.0, 0.0, 0.01 * t_s}), {t_s, 0.0, 0.0});
  });
  TrajectoryErrorOptions options;
  options.rpe_delta_s = GENERATE(1.0, 2.5);
  const TeamError speed = error_of(truth, fast, options);
  CHECK(speed.joint.rpe_translation_m.rmse == Approx(0.02 * options.rpe_delta_s));
  CHECK(speed.joint.rpe_translation_m.count ==
        static_cast<std::size_t>(101 - std::lround(10.0 * options.rpe_delta_s)));
  CHECK(speed.joint.rpe_rotation_deg.max < 1e-4);
  const TeamError turn = error_of(truth, turned, options);
  CHECK(turn.joint.rpe_rotation_deg.rmse ==
        Approx(0.01 * options.rpe_delta_s * 180.0 / std::numbers::pi).epsilon(1e-6));
}

TEST_CASE("One alignment for a team shows how far its robots are apart", "[evaluation]") {
  // Two perfect estimates, the second 6 cm too high: the best compromise errs by 3 cm everywhere.
  const auto truth = square(0.0);
  const auto lifted =
      moved(truth, make_pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.0, 0.0, 0.06)));
  const std::vector<TrajectoryInput> inputs = {{"a", truth, truth, {}}, {"b", truth, lifted, {}}};
  const TeamError team = trajectory_error(inputs);
  REQUIRE(team.robots.size() == 2);
  CHECK(team.robots[0].position_m.rmse == Approx(0.03));
  CHECK(team.robots[1].position_m.rmse == Approx(0.03));
  CHECK(team.joint.position_m.rmse == Approx(0.03));
  CHECK(team.joint.position_m.count == 16);
  CHECK(error_of(truth, lifted).joint.position_m.rmse < 1e-9);
}

TEST_CASE("Completeness is the covered share of the window", "[evaluation]") {
  const auto truth = sample(0.0, 100.0, 1001, curve);  // 10 s
  const auto half = sample(5.0, 20.0, 101, curve);     // 5 to 10 s
  CHECK(error_of(truth, half).joint.completeness == Approx(0.5));
  const TrajectoryInput windowed{"w", truth, half, TimeWindow{4 * kSecond, 8 * kSecond}};
  CHECK(trajectory_error({&windowed, 1}).joint.completeness == Approx(0.75));
  const std::vector<TrajectoryInput> team = {
      {"a", truth, half, TimeWindow{5 * kSecond, 10 * kSecond}}, {"b", truth, half, {}}};
  CHECK(trajectory_error(team).joint.completeness == Approx(10.0 / 15.0));
}

TEST_CASE("What cannot be compared is refused by name", "[evaluation]") {
  const auto truth = sample(0.0, 10.0, 100, curve);
  const auto elsewhere = sample(100.0, 10.0, 100, curve);
  CHECK_THROWS_WITH(error_of(truth, elsewhere),
                    Catch::StartsWith("robot: only 0 of its 100 poses fall on the truth's time"));
  CHECK_THROWS_AS(error_of(truth, {}), std::invalid_argument);
  CHECK_THROWS_AS(error_of({}, truth), std::invalid_argument);
  CHECK_THROWS_AS(trajectory_error({}), std::invalid_argument);
  TrajectoryErrorOptions options;
  options.rpe_delta_s = 0.0;
  CHECK_THROWS_AS(error_of(truth, truth, options), std::invalid_argument);
  options = {};
  options.with_scale = true;
  const auto still = sample(0.0, 10.0, 100, [](double) { return SE3::Identity(); });
  CHECK_THROWS_WITH(error_of(truth, still, options), Catch::Contains("do not vary"));
  CHECK(error_of(truth, still).joint.position_m.rmse > 0.1);
}

TEST_CASE("The error of a real estimate agrees with an independent computation", "[evaluation]") {
  const auto folder = shared_data("trajectory_eval");
  if (!folder) return;
  const auto truth = read_trajectory(*folder / "freiburg1_xyz-groundtruth.txt");
  const auto estimate = read_trajectory(*folder / "freiburg1_xyz-rgbdslam.txt");
  // The same interpolation, aligned by Horn's quaternion method (JOSA A 1987) in a program that
  // shares no code with this one; it prints 1e-7 m.
  const TeamError rigid = error_of(truth, estimate);
  CHECK(rigid.joint.position_m.count == 785);
  CHECK(rigid.joint.position_m.rmse == Approx(0.0134670).margin(1e-7));
  CHECK(rigid.joint.position_m.mean == Approx(0.0120269).margin(1e-7));
  CHECK(rigid.joint.position_m.median == Approx(0.0110964).margin(1e-7));
  CHECK(rigid.joint.position_m.max == Approx(0.0352146).margin(1e-7));
  TrajectoryErrorOptions options;
  options.with_scale = true;
  const TeamError similar = error_of(truth, estimate, options);
  CHECK(similar.alignment.scale == Approx(1.0078026).margin(1e-7));
  CHECK(similar.joint.position_m.rmse == Approx(0.0133902).margin(1e-7));
}

}  // namespace km
