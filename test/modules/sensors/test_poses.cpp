#include <catch2/catch.hpp>

#include "modules/core/lie.hpp"
#include "modules/core/stamp.hpp"
#include "modules/sensors/sample_streams.hpp"
#include "test/modules/sensors/euroc_folder.hpp"

namespace km {
namespace {

const SE3 kStart = se3_exp((Vector6() << 0.1, 0.2, 0.3, 1, 2, 3).finished());
const Vector6 kTwist = (Vector6() << 0.2, -0.1, 0.4, 0.5, 0.2, -0.3).finished();  // [1/s]

SE3 pose_at(double t_s) {
  return kStart * se3_exp(t_s * kTwist);
}

TEST_CASE("Between poses the body moves at constant velocity", "[sensors][poses]") {
  PoseStream poses;
  for (const double t_s : {10.0, 10.4, 11.0})
    poses.add(nanoseconds(t_s), {pose_at(t_s), t_s * Matrix6::Identity()});
  CHECK(!poses.starts_by(nanoseconds(9.9)));
  CHECK(poses.starts_by(nanoseconds(10.0)));
  CHECK(!poses.at(nanoseconds(9.9)));
  for (const double t_s : {10.0, 10.1, 10.4, 10.75, 11.0}) {
    CAPTURE(t_s);
    REQUIRE(poses.reaches(nanoseconds(t_s)));
    const auto pose = poses.at(nanoseconds(t_s));
    REQUIRE(pose);
    CHECK(pose->T_odom_body.isApprox(pose_at(t_s), 1e-9));
    CHECK(pose->covariance(2, 2) == Approx(t_s));
  }
  CHECK(!poses.reaches(nanoseconds(11.1)));
  CHECK(!poses.at(nanoseconds(11.1)));
  poses.add(nanoseconds(12.5), {pose_at(12.5)});  // further away than the longest step
  CHECK(!poses.at(nanoseconds(12.0)));
  CHECK(poses.at(nanoseconds(12.5)));
}

TEST_CASE("A pause of the cameras bounds the samples and poses that wait", "[sensors][poses]") {
  constexpr double kPause_s = 780.0, kRate_hz = 100.0;
  ImuStream imu;
  for (int k = 0; k <= kPause_s * kRate_hz; ++k) imu.add({.stamp = nanoseconds(k / kRate_hz)});
  (void)imu.until(nanoseconds(1.0));
  const auto packet = imu.until(nanoseconds(kPause_s));
  CHECK(packet.back().stamp == nanoseconds(kPause_s));
  CHECK(packet.back().stamp - packet.front().stamp == nanoseconds(ImuStream::kLongest_s));

  PoseStream poses;
  poses.add(0, {pose_at(0.0), Matrix6::Zero()});
  poses.add(nanoseconds(1.0), {pose_at(1.0), Matrix6::Zero()});
  poses.drop_before(nanoseconds(1.0));
  CHECK(!poses.at(nanoseconds(0.5)));
  CHECK(poses.at(nanoseconds(1.0)));

  // The gyroscope continues without an accelerometer.
  ImuJoiner joiner;
  for (int k = 0; k <= kPause_s; ++k) joiner.add_gyro({.stamp = nanoseconds(k)});
  CHECK(joiner.lost() == static_cast<std::size_t>(kPause_s - ImuStream::kLongest_s));
}

TEST_CASE("A covariance of ROS becomes that of the body's perturbation", "[sensors][poses]") {
  const SE3 T_odom_child = pose_at(1.0);
  const SE3 T_child_body = se3_exp((Vector6() << -0.3, 0.5, 0.2, 0.7, -0.4, 0.9).finished());
  const int axis = GENERATE(0, 1, 2, 3, 4, 5);  // axis of ROS: x, y, z, and rotations about them
  CAPTURE(axis);
  Vector6 one = Vector6::Zero();
  one[axis] = 1.0;
  const MeasuredPose pose = measured_pose(T_odom_child, one * one.transpose(), T_child_body);
  CHECK(pose.T_odom_body.isApprox(T_odom_child * T_child_body, 1e-12));
  // The child moved and rotated a little along the axes of odom, about its own origin.
  constexpr double kStep = 1e-6;
  SE3 moved = T_odom_child;
  moved.translation() += kStep * one.head<3>();
  moved.linear() = so3_exp(kStep * one.tail<3>()) * T_odom_child.linear();
  const Vector6 xi = se3_log(pose.T_odom_body.inverse() * moved * T_child_body) / kStep;
  CHECK(pose.covariance.isApprox(xi * xi.transpose(), 1e-5));
}

TEST_CASE("A message of an odometry without a valid pose is refused", "[sensors][poses]") {
  RosOdometry message;
  message.pose.pose.position = {1, 2, 3};
  message.pose.covariance[0] = 0.25;
  REQUIRE(measured_pose(message, SE3::Identity()));
  CHECK(measured_pose(message, SE3::Identity())->covariance(3, 3) == 0.25);
  message.pose.covariance[0] = -1.0;  // unknown
  CHECK(measured_pose(message, SE3::Identity())->covariance.isZero());
  message.pose.pose.orientation.coeffs().setZero();
  CHECK(!measured_pose(message, SE3::Identity()));
  message.pose.pose.orientation.setIdentity();
  message.pose.pose.position.x() = std::nan("");
  CHECK(!measured_pose(message, SE3::Identity()));
}

TEST_CASE("A file of poses is read row by row", "[sensors][poses]") {
  const TemporaryFolder folder;
  std::string covariance, negative;
  for (int k = 0; k < 36; ++k) covariance += k % 7 == 0 ? " 0.5" : " 0";
  for (int k = 0; k < 36; ++k) negative += k % 7 == 0 ? " -0.5" : " 0";
  ReaderReport report;
  PoseStream poses = read_pose_file(folder.write("poses.tum",
                                                 "# t x y z qx qy qz qw\n"
                                                 "10.0 1 2 3 0 0 0 1\n"
                                                 "10.5 1 2 4 0 0 0 1" +
                                                     covariance +
                                                     "\n"
                                                     "10.6 1 2 4 0 0 0 7\n"
                                                     "10.7 1 2 4 0 0 0\n"
                                                     "10.2 1 2 4 0 0 0 1\n"
                                                     "x 1 2 4 0 0 0 1\n"
                                                     "11.0 1 2 5 0 0 0 1 0.5\n"
                                                     "11.0 1 2 5 0 0 1 0\n"
                                                     "12.0 1 2 5 0 0 1 0" +
                                                     negative + '\n'),
                                    report);
  const auto at = poses.at(nanoseconds(10.25));
  REQUIRE(at);
  CHECK(at->T_odom_body.translation().isApprox(Eigen::Vector3d(1, 2, 3.5)));
  CHECK(at->covariance.isApprox(0.25 * Matrix6::Identity()));
  CHECK(poses.at(nanoseconds(11.0))->T_odom_body.translation().z() == 5.0);
  CHECK(poses.at(nanoseconds(12.0))->covariance.isZero());  // negative variances are unknown
  CHECK(report.count(ReaderFault::kMalformedRow) == 4);
  CHECK(report.count(ReaderFault::kUnorderedStamp) == 1);
  CHECK_THAT(report.entries().at(ReaderFault::kMalformedRow).first,
             Catch::Contains("poses.tum line 4: the quaternion's norm is not 1"));
  CHECK_THROWS_WITH(read_pose_file(folder.write("none.tum", "1 2 3\n"), report),
                    Catch::Contains("none.tum: no pose in it: t[s] x y z qx qy qz qw; ") &&
                        Catch::EndsWith("none.tum line 1: has 3 fields, not 8 or 44"));
}

TEST_CASE("Packets get the poses of a file and frames without one are counted",
          "[sensors][poses]") {
  const EurocFolder folder;  // eight frames from 10 s on, at 20 Hz
  folder.write("poses.tum", "10.025 0 0 0 0 0 0 1\n10.075 1 0 0 0 0 0 1\n10.225 4 0 0 0 0 0 1\n");
  PoseFileReader reader(std::make_unique<FolderReader>(open_folder(folder.root())),
                        folder.mav0() / "poses.tum");
  CHECK(reader.gives_poses());
  std::vector<double> x;
  while (const auto packet = reader.next())
    x.push_back(packet->pose->T_odom_body.translation().x());
  REQUIRE(x.size() == 4);
  CHECK(x[0] == Approx(0.5));
  CHECK(x[3] == Approx(3.5));
  CHECK(reader.report().count(ReaderFault::kFrameWithoutPose) == 4);
}

}  // namespace
}  // namespace km
