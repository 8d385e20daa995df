#include <catch2/catch.hpp>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/evaluation/surroundings_alignment.hpp"

namespace km {
namespace {

constexpr Stamp kStep = 100'000'000;

// Straight ahead along x, 1 m a pose, turning its head as it goes.
std::vector<StampedPose> straight_way(int poses) {
  std::vector<StampedPose> way;
  for (int i = 0; i < poses; ++i)
    way.push_back({i * kStep, make_pose(so3_exp({0.0, 0.0, 0.1 * i}), {1.0 * i, 0.0, 0.0})});
  return way;
}

std::vector<StampedPose> moved(const SE3& T, std::vector<StampedPose> way) {
  for (StampedPose& pose : way) pose.T = T * pose.T;
  return way;
}

}  // namespace

TEST_CASE("Surroundings are aligned where the way is straight, or a single pose",
          "[surroundings_alignment]") {
  const int poses = GENERATE(1, 2, 20);
  const SE3 T_truth_estimate = make_pose(so3_exp({0.4, -0.2, 2.0}), {5, -3, 2});
  const auto estimate = straight_way(poses);
  const auto truth = moved(T_truth_estimate, estimate);
  const std::vector<TrajectoryInput> inputs = {{"a", truth, estimate, std::nullopt}};
  const SE3 found = align_surroundings(inputs);
  CHECK((found.matrix() - T_truth_estimate.matrix()).norm() < 1e-9);
}

TEST_CASE("A heading that is wrong weighs less over a long way than over a short one",
          "[surroundings_alignment]") {
  const auto heading_error = [](int poses) {
    const auto truth = straight_way(poses);
    auto estimate = truth;  // places are right, but the camera is turned by a tenth
    for (StampedPose& pose : estimate) pose.T.linear() = pose.T.linear() * so3_exp({0, 0, 0.1});
    const std::vector<TrajectoryInput> inputs = {{"a", truth, estimate, std::nullopt}};
    return angle_of(align_surroundings(inputs).linear());
  };
  CHECK(heading_error(2) > 0.09);
  CHECK(heading_error(200) < 0.005);
}

TEST_CASE("Trajectories that share no time are refused by name", "[surroundings_alignment]") {
  const auto truth = straight_way(3);
  auto late = truth;
  for (StampedPose& pose : late) pose.stamp += 1000 * kStep;
  const std::vector<TrajectoryInput> inputs = {{"late", truth, late, std::nullopt}};
  CHECK_THROWS_WITH(align_surroundings(inputs),
                    "late: none of its 3 poses falls on the truth's time");
  CHECK_THROWS_AS(align_surroundings({}), std::invalid_argument);
}

}  // namespace km
