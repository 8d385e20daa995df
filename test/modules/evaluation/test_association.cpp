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

TEST_CASE("Pairs are taken at the stamps of the sparser trajectory", "[evaluation]") {
  const auto dense = sample(0.0, 100.0, 1001, screw);
  const auto sparse = sample(2.003, 10.0, 51, screw);
  for (const bool estimate_is_sparse : {true, false}) {
    CAPTURE(estimate_is_sparse);
    const auto pairs = estimate_is_sparse ? associate(dense, sparse, kAlways, 0.1, 0.0)
                                          : associate(sparse, dense, kAlways, 0.1, 0.0);
    REQUIRE(pairs.size() == 51);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      CHECK(pairs[i].stamp == sparse[i].stamp);
      CHECK(pairs[i].T_truth_body.isApprox(pairs[i].T_estimate_body, 1e-9));
    }
  }
}

TEST_CASE("Only the window and the time in common are paired", "[evaluation]") {
  const auto truth = sample(0.0, 100.0, 1001, screw);   // 0 to 10 s
  const auto estimate = sample(8.0, 10.0, 101, screw);  // 8 to 18 s
  CHECK(associate(truth, estimate, kAlways, 0.1, 0.0).size() == 21);
  CHECK(associate(truth, estimate, {9 * kSecond, 11 * kSecond}, 0.1, 0.0).size() == 11);
  CHECK(associate(truth, estimate, {11 * kSecond, 12 * kSecond}, 0.1, 0.0).empty());
  CHECK(associate(truth, {}, kAlways, 0.1, 0.0).empty());
  CHECK(associate(truth, sample(50.0, 10.0, 5, screw), kAlways, 0.1, 0.0).empty());
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
