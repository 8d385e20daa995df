#include "modules/core/data/pose_changes.hpp"
#include "modules/core/geometry/lie.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr RobotId kSelf = 3;

std::vector<SE3> line(std::size_t count) {
  std::vector<SE3> poses(count, SE3::Identity());
  for (std::size_t k = 0; k < count; ++k) poses[k].translation().x() = 0.1 * static_cast<double>(k);
  return poses;
}

// Number of poses that are stated.
std::size_t stated(StatedPoses& poses, const Trajectory& trajectory) {
  const auto changes = poses.update(trajectory);
  return changes ? changes->poses.size() : 0;
}

}  // namespace

TEST_CASE("A pose is stated again when it has moved") {
  StatedPoses poses;
  Trajectory trajectory{kSelf, kSelf, line(100)};
  CHECK(stated(poses, trajectory) == 100);
  CHECK(stated(poses, trajectory) == 0);
  SECTION("not within the bound") {
    for (SE3& T : trajectory.T_world_kf) T.translation().x() += 0.009;
    CHECK(stated(poses, trajectory) == 0);
  }
  SECTION("in small steps, once their sum is beyond the bound") {
    std::size_t count = 0;
    for (int step = 1; step <= 12; ++step) {  // 4 mm: stated after 3, 6, 9, 12 of them.
      trajectory.T_world_kf[40].translation().x() += 0.004;
      count += stated(poses, trajectory);
    }
    CHECK(count == 4);
  }
  SECTION("turned") {
    trajectory.T_world_kf[7].linear() = so3_exp({0.0, 0.0, 0.4 / kDegrees});
    CHECK(stated(poses, trajectory) == 0);
    trajectory.T_world_kf[7].linear() = so3_exp({0.0, 0.0, 0.6 / kDegrees});
    CHECK(stated(poses, trajectory) == 1);
  }
  SECTION("all of them in another frame") {
    trajectory.anchor = 1;
    const auto changes = poses.update(trajectory);
    REQUIRE(changes);
    CHECK(changes->anchor == 1);
    CHECK(changes->poses.size() == 100);
  }
  SECTION("not if a pose is not finite") {
    trajectory.anchor = 1;
    trajectory.T_world_kf[0].translation().y() = std::numeric_limits<double>::quiet_NaN();
    CHECK(stated(poses, trajectory) == 0);
  }
}

TEST_CASE("Covariances and poses of other robots are stated when they change") {
  StatedPoses poses;
  Trajectory trajectory{kSelf, kSelf, line(3)};
  CHECK(stated(poses, trajectory) == 3);
  trajectory.covariances = std::vector<Matrix6>(2, Matrix6::Identity());
  auto changes = poses.update(trajectory);
  REQUIRE(changes);
  REQUIRE(changes->poses.size() == 2);
  CHECK(changes->poses[1].covariance == Matrix6::Identity());
  trajectory.covariances[0] *= 1.2;  // within the bound
  CHECK(stated(poses, trajectory) == 0);
  trajectory.covariances[0] *= 1.2;
  CHECK(stated(poses, trajectory) == 1);
  trajectory.public_poses[{1, 5}] = SE3::Identity();
  changes = poses.update(trajectory);
  REQUIRE(changes);
  REQUIRE(changes->poses.size() == 1);
  CHECK(changes->poses[0].id == KeyframeId{1, 5});
}

}  // namespace km
