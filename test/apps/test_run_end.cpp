#include <catch2/catch.hpp>

#include "apps/robot/run_end.hpp"

namespace km {
namespace {

RunEnd usual_end() {
  RunEnd end;
  end.robot = 7;
  end.departure = "all present robots have settled";
  end.images = ImageCounts{.listed = 100, .read = 90, .skipped = 6, .with_pose = 88};
  return end;
}

TEST_CASE("A run with poses is a success that tells how many", "[run_end]") {
  const Verdict verdict = verdict_of(usual_end());
  CHECK(verdict.exit_code == 0);
  CHECK(verdict.reason == "all present robots have settled");
  CHECK(to_string(*usual_end().images) == "88 of 100 images have a pose");
}

TEST_CASE("A run without a single pose is none, and tells where the images went", "[run_end]") {
  RunEnd end = usual_end();
  end.images->with_pose = 0;
  const Verdict verdict = verdict_of(end);
  CHECK(verdict.exit_code == 1);
  CHECK(verdict.reason ==
        "no pose estimated: of 100 images, 4 could not be used, 6 were skipped to keep the rate, "
        "90 were read but odometry did not start on them");
}

TEST_CASE("Without sensors, or interrupted, no pose is no failure", "[run_end]") {
  RunEnd graph = usual_end();
  graph.images.reset();
  CHECK(verdict_of(graph).exit_code == 0);
  RunEnd interrupted = usual_end();
  interrupted.images->with_pose = 0;
  interrupted.result.interrupted = true;
  CHECK(verdict_of(interrupted).exit_code == 0);
  CHECK(verdict_of(interrupted).reason == "interrupted");
}

TEST_CASE("A second robot of the same id is a failure, a failed module a greater one",
          "[run_end]") {
  RunEnd end = usual_end();
  end.id_taken = true;
  CHECK(verdict_of(end).exit_code == 3);
  CHECK_THAT(verdict_of(end).reason, Catch::Contains("another robot claimed this robot's id 7"));
  end.result.failure = RunResult::Failure{"vio", "out of memory"};
  CHECK(verdict_of(end).exit_code == 3);
  CHECK(verdict_of(end).reason == "vio: out of memory");
}

}  // namespace
}  // namespace km
