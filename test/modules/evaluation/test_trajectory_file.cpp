#include "modules/evaluation/trajectory_file.hpp"

#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {

TEST_CASE("TUM and EuRoC rows give the same pose, and the first of equal stamps counts") {
  const std::string text =
      GENERATE("# t tx ty tz qx qy qz qw\n1403636579.758555392 1 2 3 0 0 0.6 0.8\n",
               "#timestamp, p, q, v\n1403636579758555392,1,2,3,0.8,0,0,0.6,9,9,9\n",
               "timestamp,px\r\n1403636579758555392 , 1, 2, 3, 0.8, 0, 0, 0.6 # a, comment\r\n",
               "1.403636579758555392e+09 1 2 3 0 0 0.6 0.8 # a, comment\n");
  CAPTURE(text);
  const auto poses = parse_trajectory(text, "x");
  REQUIRE(poses.size() == 1);
  CHECK(poses[0].stamp == 1403636579758555392);
  CHECK(poses[0].T.translation() == Eigen::Vector3d(1, 2, 3));
  const Eigen::Quaterniond q(0.8, 0.0, 0.0, 0.6);
  CHECK(poses[0].T.linear().isApprox(q.toRotationMatrix(), 1e-12));
  const auto repeated =
      parse_trajectory("1 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n", "p");
  REQUIRE(repeated.size() == 2);
  CHECK(repeated[0].T.translation().x() == 1.0);
}

TEST_CASE("An impossible trajectory is refused with file and line") {
  struct Case {
    const char *text, *message;
  };
  const std::string good = "# c\n1.0 0 0 0 0 0 0 1\n";
  const Case c = GENERATE(
      Case{"2.0 0 0 0 0 0 1\n", "poses.txt line 3: 7 fields, expected 8"},
      Case{"2.0 0 0 0 0 0 x 1\n", "poses.txt line 3: x is not a finite number"},
      Case{"2.0 0 nan 0 0 0 0 1\n", "poses.txt line 3: nan is not a finite number"},
      Case{"2.0 0 0 0 0 0 0 1.1\n", "poses.txt line 3: the quaternion's norm is 1.1"},
      Case{"2.0 0 0 0 0 0 0 0\n", "poses.txt line 3: the quaternion's norm is 0.0"},
      Case{"2 1e300 0 0 0 0 0 1\n", "poses.txt line 3: a coordinate of 1e+300 m is beyond 1e+09"},
      Case{"two 0 0 0 0 0 0 1\n", "poses.txt line 3: two is not a stamp in seconds"},
      Case{"0.5 0 0 0 0 0 0 1\n", "poses.txt line 3: the stamp is before the last one"});
  CAPTURE(c.text);
  CHECK_THROWS_WITH(parse_trajectory(good + c.text, "poses.txt"), Contains(c.message));
  CHECK_THROWS_WITH(parse_trajectory("1.5,0,0,0,1,0,0,0\n", "p"),
                    Contains("p line 1: 1.5 is not a stamp in nanoseconds"));
  CHECK_THROWS_WITH(parse_trajectory("9223372036854775807,0,0,0,1,0,0,0\n", "a.csv"),
                    Contains("line 1: 9223372036854775807 is not a stamp"));
  CHECK_THROWS_WITH(parse_trajectory("# nothing\n", "p"), "p: holds no pose");
  CHECK_THROWS_WITH(read_trajectory("/nowhere.txt"), "/nowhere.txt: no such file");
}

TEST_CASE("A header names the columns, and sizes of stamps their unit") {
  const std::string text = GENERATE(
      // OKVIS2, Basalt, MCD, ORB-SLAM3, TUM in milliseconds, a header with seconds and commas
      "timestamp, p_WS_W_x, p_WS_W_y, p_WS_W_z, q_WS_x, q_WS_y, q_WS_z, q_WS_w, v_WS_W_x\n"
      "1403636579758000000, 1, 2, 3, 0, 0, 0.6, 0.8, 9\n",
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z "
      "[]\n1403636579758000000,1,2,3,0.8,0,0,0.6\n",
      "num t x y z qx qy qz qw\n7 1403636579.758 1 2 3 0 0 0.6 0.8\n",
      "num,t,x,y,z,qx,qy,qz,qw\n7,1403636579.758,1,2,3,0,0,0.6,0.8\n",
      "1403636579758000000.000000 1 2 3 0 0 0.6 0.8\n", "1403636579758 1 2 3 0 0 0.6 0.8\n",
      "time,tx,ty,tz,qx,qy,qz,qw\n1403636579.758,1,2,3,0,0,0.6,0.8\n");
  CAPTURE(text);
  const auto poses = parse_trajectory(text, "x");
  REQUIRE(poses.size() == 1);
  CHECK(poses[0].stamp == 1403636579758000000);
  CHECK(poses[0].T.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(poses[0].T.linear().isApprox(Eigen::Quaterniond(0.8, 0, 0, 0.6).toRotationMatrix(), 1e-12));
}

TEST_CASE("The true poses of a recording in EuRoC's layout are found") {
  const TemporaryFolder folder;
  const auto file = folder.write("mav0/state_groundtruth_estimate0/data.csv", "");
  for (const auto& place : {folder.path(), folder.path() / "mav0", file.parent_path(), file})
    CHECK(find_trajectory(place) == file);
}

TEST_CASE("Stamps in microseconds are refused where nanoseconds are expected") {
  std::string text;
  for (int k = 0; k < 20; ++k)
    text += std::to_string(1403636579758555 + 50000 * k) + ",0,0,0,1,0,0,0\n";
  CHECK_THROWS_WITH(parse_trajectory(text, "a.csv"),
                    "a.csv: 20000 poses a second: stamps are to be nanoseconds; are they "
                    "microseconds, milliseconds or seconds?");
}

TEST_CASE("Faulty rows of an odometry are skipped, and covariances may be absent") {
  const TemporaryFolder folder;
  std::string covariance;
  for (int k = 0; k < 36; ++k) covariance += k % 7 == 0 ? " 0.5" : " 0";
  std::string faults;
  const auto read = [&](const std::string& text) {
    return read_uncertain_trajectory(folder.write("poses.tum", text),
                                     [&](const std::string& fault) { faults += fault + '\n'; });
  };
  const UncertainTrajectory poses =
      read("# t x y z qx qy qz qw\n10.0 1 2 3 0 0 0 1\n10.5 1 2 4 0 0 0 1" + covariance +
           "\n10.6 1 2 4 0 0 0 7\n"
           "10.7 1 2 4 0 0 0\n"
           "10.2 1 2 4 0 0 0 1\n"
           "x 1 2 4 0 0 0 1\n"
           "11.0 1 2 5 0 0 0 1 0.5\n"
           "11.0 1 2 6 0 0 1 0\n");
  CHECK(poses.lines == std::vector{2, 3, 6, 8});
  CHECK(poses.poses[3].T.translation().z() == 5.0);
  CHECK(poses.covariances[0].isZero());
  CHECK(poses.covariances[1].isApprox(0.5 * Matrix6::Identity()));
  CHECK(std::ranges::count(faults, '\n') == 3);
  CHECK_THAT(faults, Contains("poses.tum line 4: the quaternion's norm is 7"));
  CHECK(read("1403636579758555392,1,2,3,0.8,0,0,0.6,9,9,9\n").poses[0].stamp ==
        1403636579758555392);
  folder.write("times.txt", "0.5\n0.6\n");
  CHECK(
      read("1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 1 0 1 0 2 0 0 1 4\n").poses.at(1).T.translation().z() ==
      4.0);
}

TEST_CASE("Poses of KITTI have their stamps in times.txt, and a bag is no trajectory") {
  const TemporaryFolder folder;
  folder.write("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 4 1 0 0 5 0 0 1 6\n");
  const auto file = folder.path() / "poses/07.txt";
  CHECK_THROWS_WITH(read_trajectory(file), Contains("put times.txt beside it"));
  folder.write("sequences/07/times.txt", "0.0\n1.036e-01\n");
  const auto poses = read_trajectory(file);
  REQUIRE(poses.size() == 2);
  CHECK(poses[1].stamp == 103600000);
  CHECK(poses[1].T.translation() == Eigen::Vector3d(4, 5, 6));
  CHECK(poses[1].T.linear().col(0).isApprox(Eigen::Vector3d::UnitY()));
  folder.write("a.bag", "#ROSBAG V2.0\n");
  CHECK_THROWS_WITH(read_trajectory(folder.path() / "a.bag"), Contains("is a recording"));
}

}  // namespace km
