#include <catch2/catch.hpp>

#include "apps/robot/pose_holes.hpp"
#include "apps/robot/results.hpp"

namespace km {
namespace {

std::vector<StampedPose> poses_at(const std::vector<double>& times_s) {
  std::vector<StampedPose> poses;
  for (const double time_s : times_s) poses.push_back({nanoseconds(time_s), SE3::Identity()});
  return poses;
}

std::vector<double> every(double interval_s, int count) {
  std::vector<double> times_s;
  for (int k = 0; k < count; ++k) times_s.push_back(interval_s * k);
  return times_s;
}

}  // namespace

TEST_CASE("A hole is an interval between poses that is far longer than usual",
          "[robot][findings]") {
  CHECK(pose_holes({}).empty());
  CHECK(pose_holes(poses_at({7.0})).empty());
  CHECK(pose_holes(poses_at(every(0.05, 100))).empty());
  CHECK(pose_holes(poses_at(every(2.0, 100))).empty());  // as it is throughout
  std::vector<double> times_s = every(0.05, 21);
  times_s.insert(times_s.end(), {1.9, 1.95, 8.25, 8.3});
  const auto holes = pose_holes(poses_at(times_s));
  REQUIRE(holes.size() == 1);
  CHECK(holes[0].from == nanoseconds(1.95));
  CHECK(holes[0].to == nanoseconds(8.25));
}

TEST_CASE("The summary has the holes of the live trajectory", "[robot][findings]") {
  RunRecord record(1);
  for (const StampedPose& pose : poses_at(every(0.05, 21))) record.add(OdometryState{pose.stamp});
  CHECK_FALSE(summary_of(record).holes.has_value());
  for (const double time_s : {7.0, 7.05, 9.05}) record.add(OdometryState{nanoseconds(time_s)});
  const auto holes = summary_of(record).holes;
  REQUIRE(holes.has_value());
  CHECK(holes->count == 2);
  CHECK(holes->seconds == Approx(8.0));
  CHECK(holes->longest_s == Approx(6.0));
  CHECK(holes->longest_from_s == Approx(1.0));
}

}  // namespace km
