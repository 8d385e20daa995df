#include <catch2/catch.hpp>

#include "apps/robot/input_time.hpp"

namespace km {

TEST_CASE("The time of the input is from its first stamp to its latest, and never goes back",
          "[robot]") {
  constexpr Stamp kSecond = 1'000'000'000;
  InputTime time;
  CHECK(time.seconds() == 0.0);
  time.reach(100 * kSecond);
  CHECK(time.seconds() == 0.0);
  time.reach(104 * kSecond);
  time.reach(103 * kSecond);  // a keyframe, which odometry makes of an image of before
  CHECK(time.seconds() == 4.0);
}

}  // namespace km
