#include <nlohmann/json.hpp>

#include "modules/core/data/stamped_pose.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/quantile.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/page_text.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr Stamp kSecond = 1'000'000'000;

// `count` poses at `rate_hz` from `from_s` on; pose(t_s) returns each.
template <typename Pose>
std::vector<StampedPose> sample(double from_s, double rate_hz, int count, const Pose& pose) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < count; ++i) {
    const double t_s = from_s + i / rate_hz;
    poses.push_back({static_cast<Stamp>(t_s * 1e9 + 0.5), pose(t_s)});
  }
  return poses;
}

// A smooth curve without symmetries.
SE3 curve(double t_s) {
  return make_pose(so3_exp({0.3 * std::sin(t_s), 0.2 * std::cos(0.7 * t_s), 0.5 * t_s}),
                   {std::sin(t_s), std::cos(0.8 * t_s) + 0.1 * t_s, 0.3 * std::sin(1.7 * t_s)});
}

std::vector<StampedPose> moved(std::vector<StampedPose> poses, const SE3& T) {
  for (StampedPose& pose : poses) pose.T = T * pose.T;
  return poses;
}

TeamError error_of(const std::vector<StampedPose>& truth,
                   const std::vector<StampedPose>& estimate) {
  const TrajectoryInput input{"robot", truth, estimate, {}};
  return trajectory_error({&input, 1});
}

// Corners of a square in the plane, visited in turn.
std::vector<StampedPose> square() {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 8; ++i) {
    const double x = i % 4 == 0 || i % 4 == 3 ? 1.0 : -1.0;
    const double y = i % 4 < 2 ? 1.0 : -1.0;
    poses.push_back({(i + 1) * kSecond, make_pose(Eigen::Matrix3d::Identity(), {x, y, 0.0})});
  }
  return poses;
}

TEST_CASE("Quantiles lie linearly between the values") {
  const std::vector<double> values = {40.0, 10.0, 30.0, 20.0, 50.0};
  CHECK(quantile(values, 0.0) == 10.0);
  CHECK(quantile(values, 0.5) == 30.0);
  CHECK(quantile(values, 0.625) == Approx(35.0));
  CHECK(quantile(values, 1.0) == 50.0);
  CHECK(quantile({7.0}, 0.3) == 7.0);
  CHECK(std::isnan(quantile({}, 0.5)));
}

TEST_CASE("A moved copy of the truth has no error") {
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
  CHECK((rigid.T_truth_estimate * T).isApprox(SE3::Identity(), 1e-9));
  CHECK(rigid.joint.completeness == Approx(1.0));
  auto shrunk = truth;
  for (StampedPose& pose : shrunk) pose.T.translation() *= 0.25;
  CHECK(error_of(truth, shrunk).joint.position_m.rmse > 0.1);
}

TEST_CASE("Relative errors are the drift over a second") {
  // 1 m/s with 2 % too much speed, and a rotation of 0.01 rad/s too much.
  const auto truth = sample(0.0, 10.0, 101, [](double t_s) {
    return make_pose(Eigen::Matrix3d::Identity(), {t_s, 0.0, 0.0});
  });
  const auto fast = sample(0.0, 10.0, 101, [](double t_s) {
    return make_pose(Eigen::Matrix3d::Identity(), {1.02 * t_s, 0.0, 0.0});
  });
  const auto turned = sample(0.0, 10.0, 101, [](double t_s) {
    return make_pose(so3_exp({0.0, 0.0, 0.01 * t_s}), {t_s, 0.0, 0.0});
  });
  const TeamError speed = error_of(truth, fast);
  CHECK(speed.joint.rpe_translation_m.rmse == Approx(0.02));
  CHECK(speed.joint.rpe_translation_m.count == 91);
  CHECK(speed.joint.rpe_rotation_deg.max < 1e-4);
  CHECK(error_of(truth, turned).joint.rpe_rotation_deg.rmse ==
        Approx(kDegrees * 0.01).epsilon(1e-6));
}

TEST_CASE("One alignment for a team shows the distance between its robots") {
  // Two perfect estimates, the second 6 cm too high: the best compromise errs by 3 cm everywhere.
  const auto truth = square();
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

TEST_CASE("Completeness is the covered share of the window") {
  const auto truth = sample(0.0, 100.0, 1001, curve);  // 10 s
  const auto half = sample(5.0, 20.0, 101, curve);     // 5 to 10 s
  CHECK(error_of(truth, half).joint.completeness == Approx(0.5));
  const TrajectoryInput windowed{"w", truth, half, TimeWindow{4 * kSecond, 8 * kSecond}};
  CHECK(trajectory_error({&windowed, 1}).joint.completeness == Approx(0.75));
  const std::vector<TrajectoryInput> team = {
      {"a", truth, half, TimeWindow{5 * kSecond, 10 * kSecond}}, {"b", truth, half, {}}};
  CHECK(trajectory_error(team).joint.completeness == Approx(10.0 / 15.0));
}

TEST_CASE("Trajectories that cannot be compared are refused by name") {
  const auto truth = sample(0.0, 10.0, 100, curve);
  const auto elsewhere = sample(100.0, 10.0, 100, curve);
  CHECK_THROWS_WITH(error_of(truth, elsewhere),
                    StartsWith("robot: only 0 of its 100 poses fall on the truth's time"));
  const std::vector<TrajectoryInput> late = {{"late", truth, elsewhere, std::nullopt}};
  CHECK_THROWS_WITH(align_surroundings(late),
                    "late: none of its 100 poses falls on the truth's time");
  CHECK_THROWS_AS(align_surroundings({}), std::invalid_argument);
  CHECK_THROWS_AS(error_of(truth, {}), std::invalid_argument);
  CHECK_THROWS_AS(error_of({}, truth), std::invalid_argument);
  CHECK_THROWS_AS(trajectory_error({}), std::invalid_argument);
  const auto still = sample(0.0, 10.0, 100, [](double) { return SE3::Identity(); });
  CHECK(error_of(truth, still).joint.position_m.rmse > 0.1);
}

TEST_CASE("The error of a real estimate agrees with an independent computation") {
  const auto folder = shared_data("trajectory_eval");
  if (!folder) return;
  const auto truth = read_trajectory(*folder / "freiburg1_xyz-groundtruth.txt");
  const auto estimate = read_trajectory(*folder / "freiburg1_xyz-rgbdslam.txt");
  // The same interpolation, with the alignment by Horn's quaternion method (JOSA A 1987) of an
  // independent program, which prints 1e-7 m.
  const TeamError rigid = error_of(truth, estimate);
  CHECK(rigid.joint.position_m.count == 785);
  CHECK(rigid.joint.position_m.rmse == Approx(0.0134670).margin(1e-7));
  CHECK(rigid.joint.position_m.mean == Approx(0.0120269).margin(1e-7));
  CHECK(rigid.joint.position_m.median == Approx(0.0110964).margin(1e-7));
  CHECK(rigid.joint.position_m.max == Approx(0.0352146).margin(1e-7));
}

// `count` pairs of a truth and an estimate.
template <typename Truth, typename Estimate>
std::vector<PosePair> pairs_of(int count, const Truth& truth, const Estimate& estimate) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < count; ++i) pairs.push_back({i * kSecond / 10, truth(i), estimate(i)});
  return pairs;
}

TEST_CASE("Poses that are written differently from the truth are named") {
  const auto truth = sample(0.0, 20.0, 400, curve);
  const auto difference = [&truth](auto change) {
    const auto estimate = sample(0.0, 20.0, 400, [&](double t_s) {
      SE3 T = curve(t_s) * make_pose(so3_exp({0.0, 0.0, 0.01 * t_s}), {0.01 * t_s, 0.0, 0.0});
      change(T, Eigen::Quaterniond(T.linear()));
      return T;
    });
    return difference_of_notation({"robot", truth, estimate, {}});
  };
  using Q = Eigen::Quaterniond;
  CHECK(difference([](SE3&, const Q&) {}).empty());
  CHECK_THAT(difference([](SE3& T, const Q& q) {
               T.linear() = Q(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
             }),
             Contains("w first"));
  CHECK_THAT(difference([](SE3& T, const Q& q) {
               T.linear() = Q(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
             }),
             Contains("w first"));
  CHECK_THAT(difference([](SE3& T, const Q& q) { T.linear() = q.conjugate().toRotationMatrix(); }),
             Contains("rotations of one are inverse"));
  CHECK_THAT(difference([](SE3& T, const Q&) { T = T.inverse(); }),
             Contains("poses of one are inverse"));
  CHECK_THAT(difference([](SE3& T, const Q&) { T.translation() *= 1000.0; }),
             Contains("millimetres"));
  for (const double scale : {1.5, 20.0, 100.0})
    CHECK(difference([&](SE3& T, const Q&) { T.translation() *= scale; }).empty());
}

TEST_CASE("Drift is measured over multiples of 1, 2 and 5 up to half the path") {
  CHECK(segment_lengths(300.0) == std::vector<double>{10.0, 20.0, 50.0, 100.0});
  CHECK(segment_lengths(5.43) == std::vector<double>{0.2, 0.5, 1.0, 2.0});
  CHECK(segment_lengths(0.05).size() == 2);
  CHECK(segment_lengths(0.0).empty());
  CHECK(segment_errors(std::vector<PosePair>{}).lengths_m.empty());
}

TEST_CASE("Drift has the error of the scale, and of the rotation per metre, in any frame") {
  const double scale = GENERATE(0.9, 1.0, 1.03);
  const double step_m = 0.3;   // no divisor of the lengths
  const double turn = 0.0005;  // [rad] a step, about the direction of motion
  const SE3 T_other = make_pose(so3_exp({0.5, -0.3, 1.1}), {10.0, -4.0, 2.0});
  const auto truth = [=](int i) {
    return make_pose(Eigen::Matrix3d::Identity(), {step_m * i, 0.0, 0.0});
  };
  const auto estimate = [=](int i) {
    return T_other * make_pose(so3_exp({turn * i, 0.0, 0.0}), {scale * step_m * i, 0.0, 0.0});
  };
  const auto pairs = pairs_of(200, truth, estimate);
  const auto errors = segment_errors(pairs);
  CHECK(errors.lengths_m == std::vector<double>{2.0, 5.0, 10.0, 20.0});
  REQUIRE_FALSE(errors.translation_percent.empty());
  for (std::size_t i = 0; i < errors.translation_percent.size(); ++i) {
    CHECK(errors.translation_percent[i] == Approx(100.0 * std::abs(scale - 1.0)).margin(1e-9));
    CHECK(errors.rotation_deg_per_m[i] == Approx(kDegrees * turn / step_m).epsilon(1e-6));
  }
}

constexpr Stamp kStep = 100'000'000;

// Straight ahead along x, 1 m per pose, with a rotation.
std::vector<StampedPose> straight_way(int poses) {
  std::vector<StampedPose> way;
  for (int i = 0; i < poses; ++i)
    way.push_back({i * kStep, make_pose(so3_exp({0.0, 0.0, 0.1 * i}), {1.0 * i, 0.0, 0.0})});
  return way;
}

TEST_CASE("Surroundings are aligned on a straight path and for a single pose") {
  const int poses = GENERATE(1, 2, 20);
  const SE3 T_truth_estimate = make_pose(so3_exp({0.4, -0.2, 2.0}), {5, -3, 2});
  const auto estimate = straight_way(poses);
  const auto truth = moved(estimate, T_truth_estimate);
  const std::vector<TrajectoryInput> inputs = {{"a", truth, estimate, std::nullopt}};
  const SE3 found = align_surroundings(inputs);
  CHECK((found.matrix() - T_truth_estimate.matrix()).norm() < 1e-9);
}

TEST_CASE("Missing relative errors are not perfect errors") {
  const auto poses = sample(0.0, 20.0, 10, curve);  // half a second
  const std::vector<TrajectoryInput> inputs = {{"alpha", poses, poses, {}},
                                               {"b<&>eta", poses, poses, {}}};
  const TeamError none = trajectory_error(inputs);
  CHECK(none.joint.rpe_translation_m.count == 0);
  const std::string table = to_table(none);
  CHECK(occurrences(table, "             -      -   100.0%\n") == 3);
  CHECK(occurrences(table, "\n-: no two compared poses lie a second apart") == 1);
  const auto longer = sample(0.0, 20.0, 100, curve);
  CHECK(occurrences(to_table(error_of(longer, longer)), "no two compared poses") == 0);
  const std::string text = json_text(none.joint);
  CHECK(occurrences(text, ": null") == 8);  // four figures of translation, four of rotation
  CHECK_THAT(text, !Contains("nan"));
}

constexpr TimeWindow kAlways = {std::numeric_limits<Stamp>::min(),
                                std::numeric_limits<Stamp>::max() - 1};

// Constant velocity and angular rate: interpolation has no error.
SE3 screw(double t_s) {
  return make_pose(so3_exp({0.0, 0.0, 0.5 * t_s}), {2.0 * t_s, 1.0, 0.0});
}

TEST_CASE("Across a gap and outside the trajectory only a near pose counts") {
  const auto poses = sample(0.0, 1.0, 3, screw);
  CHECK_FALSE(pose_at(poses, kSecond * 3 / 2, 0.9, 0.1));
  CHECK(pose_at(poses, kSecond * 3 / 2, 1.0, 0.1));
  const auto near_second = pose_at(poses, kSecond + kSecond / 20, 0.9, 0.1);
  REQUIRE(near_second);
  CHECK(near_second->isApprox(screw(1.0), 1e-12));
  const auto near_third = pose_at(poses, 2 * kSecond - kSecond / 20, 0.9, 0.1);
  REQUIRE(near_third);
  CHECK(near_third->isApprox(screw(2.0), 1e-12));
  CHECK(pose_at(poses, -1000, 0.1, 0.01));
  CHECK_FALSE(pose_at(poses, -kSecond / 10, 0.1, 0.01));
  CHECK(pose_at(poses, 2 * kSecond + 1000, 0.1, 0.01));
  CHECK_FALSE(pose_at(poses, 3 * kSecond, 0.1, 0.01));
  CHECK_FALSE(pose_at({}, 0, 0.1, 0.01));
}

TEST_CASE("Covered time is that between neighbours without a gap inside the window") {
  auto poses = sample(1.0, 10.0, 11, screw);        // 1 to 2 s
  const auto later = sample(5.0, 10.0, 11, screw);  // 5 to 6 s
  poses.insert(poses.end(), later.begin(), later.end());
  CHECK(covered_seconds(poses, kAlways, 0.5) == Approx(2.0));
  CHECK(covered_seconds(poses, kAlways, 3.0) == Approx(5.0));
  CHECK(covered_seconds(poses, {3 * kSecond / 2, 11 * kSecond / 2}, 0.5) == Approx(1.0));
  CHECK(covered_seconds(poses, {3 * kSecond, 4 * kSecond}, 0.5) == 0.0);
  CHECK(covered_seconds({}, kAlways, 0.5) == 0.0);
}

}  // namespace
}  // namespace km
