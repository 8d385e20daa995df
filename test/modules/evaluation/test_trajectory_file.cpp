#include "modules/evaluation/trajectory_file.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "test/support/shared_data.hpp"

namespace km {

TEST_CASE("TUM and EuRoC rows give the same pose, and the first of equal stamps counts",
          "[evaluation]") {
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

TEST_CASE("An impossible trajectory is refused with file and line", "[evaluation]") {
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
  CHECK_THROWS_WITH(parse_trajectory(good + c.text, "poses.txt"), Catch::Contains(c.message));
  CHECK_THROWS_WITH(parse_trajectory("1.5,0,0,0,1,0,0,0\n", "p"),
                    "p line 1: 1.5 is not a stamp in nanoseconds");
  CHECK_THROWS_WITH(parse_trajectory("9223372036854775807,0,0,0,1,0,0,0\n", "a.csv"),
                    Catch::Contains("line 1: 9223372036854775807 is not a stamp"));
  CHECK_THROWS_WITH(parse_trajectory("# nothing\n", "p"), "p: holds no pose");
  CHECK_THROWS_WITH(read_trajectory("/nowhere.txt"), "/nowhere.txt: no such file");
}

}  // namespace km
