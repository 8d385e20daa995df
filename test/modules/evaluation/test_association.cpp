#include "modules/evaluation/association.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "test/modules/evaluation/trajectories.hpp"

namespace km {
namespace {

constexpr TimeWindow kAlways = {std::numeric_limits<Stamp>::min(),
                                std::numeric_limits<Stamp>::max() - 1};

// Constant velocity and angular rate: interpolation has no error.
SE3 screw(double t_s) {
  return make_pose(so3_exp({0.0, 0.0, 0.5 * t_s}), {2.0 * t_s, 1.0, 0.0});
}

}  // namespace

TEST_CASE("Across a gap and outside the trajectory only a near pose counts", "[evaluation]") {
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

TEST_CASE("Covered time is that between neighbours without a gap inside the window",
          "[evaluation]") {
  auto poses = sample(1.0, 10.0, 11, screw);        // 1 to 2 s
  const auto later = sample(5.0, 10.0, 11, screw);  // 5 to 6 s
  poses.insert(poses.end(), later.begin(), later.end());
  CHECK(covered_seconds(poses, kAlways, 0.5) == Approx(2.0));
  CHECK(covered_seconds(poses, kAlways, 3.0) == Approx(5.0));
  CHECK(covered_seconds(poses, {3 * kSecond / 2, 11 * kSecond / 2}, 0.5) == Approx(1.0));
  CHECK(covered_seconds(poses, {3 * kSecond, 4 * kSecond}, 0.5) == 0.0);
  CHECK(covered_seconds({}, kAlways, 0.5) == 0.0);
}

}  // namespace km
