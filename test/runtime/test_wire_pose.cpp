#include "runtime/dds/wire_pose.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-12;  // a rotation matrix to a quaternion and back

TEST_CASE("an odometry pose crosses the wire in single precision") {
  const auto seed = GENERATE(1U, 2U, 3U, 4U, 5U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  OdometryPose sent;
  sent.id = {65535, 4000000000U};
  sent.T_odom_kf = random_pose(rng, 1000.0);
  sent.covariance = random_covariance(rng, 0.3);

  const std::optional<OdometryPose> received = from_wire(to_wire(sent));
  REQUIRE(received);
  CHECK(received->id == sent.id);
  CHECK(received->T_odom_kf.translation() == sent.T_odom_kf.translation());
  CHECK(received->T_odom_kf.linear().isApprox(sent.T_odom_kf.linear(), 1e-6));
  CHECK(received->covariance.isApprox(sent.covariance, 1e-6));
  CHECK(is_covariance(received->covariance));
}

TEST_CASE("a pose from the wire is a rotation even if its quaternion was rounded") {
  km_wire_Pose wire = to_wire(SE3::Identity());
  wire.q[0] = 5e-4;
  wire.q[3] = 1.0005;
  const std::optional<SE3> pose = from_wire(wire);
  REQUIRE(pose);
  CHECK((pose->linear().transpose() * pose->linear()).isIdentity(kRounding));
}

TEST_CASE("poses and matrices that have no meaning are refused") {
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e300, 0.0, 0.99, 1.01, -2.0})
    for (const int slot : {3, 0, 1, 2, 4, 5, 6}) {
      if (slot != 3 && std::abs(bad) < 3.0) continue;
      CAPTURE(bad, slot);
      km_wire_Pose wire = to_wire(SE3::Identity());
      (slot < 4 ? wire.q[slot] : wire.t[slot - 4]) = bad;
      CHECK_FALSE(from_wire(wire));
    }
  CHECK(from_wire(to_wire(Matrix6(Matrix6::Zero()))) == Matrix6(Matrix6::Zero()));
  // Not finite, beyond any scale, a negative variance, and a correlation above one.
  for (const auto& [slot, value] : {std::pair(7, kNan), {0, 1e300}, {20, -1e-3}, {1, 1.1}}) {
    CAPTURE(slot, value);
    km_wire_Covariance wire = to_wire(Matrix6::Identity());
    wire.upper[slot] = value;
    CHECK_FALSE(from_wire(wire));
  }
}

TEST_CASE("an odometry pose with one bad part is refused") {
  using Change = void (*)(km_wire_OdometryPose&);
  km_wire_OdometryPose wire = to_wire(OdometryPose{});
  REQUIRE(from_wire(wire));
  const auto change = GENERATE(
      values<Change>({[](auto& its) { its.t[1] = kNan; }, [](auto& its) { its.q[0] = 4.0F; },
                      [](auto& its) { its.root[0] = std::numeric_limits<float>::infinity(); },
                      [](auto& its) { its.root[20] = 1e20F; }}));
  change(wire);
  CHECK_FALSE(from_wire(wire));
}

}  // namespace
}  // namespace km
