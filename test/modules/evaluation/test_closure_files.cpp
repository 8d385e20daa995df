#include "modules/evaluation/closure_files.hpp"

#include <catch2/catch.hpp>

#include "test/modules/evaluation/trajectories.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

const std::string kHeader =
    "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,"
    "tx,ty,tz,qx,qy,qz,qw,reason\n";

}  // namespace

TEST_CASE("Closures are read with their stages and poses", "[closure_files]") {
  const TemporaryFolder folder;
  const auto file =
      folder.write("loop_closures.csv",
                   kHeader + "3,17,60000,4,0.5,inlier,80,60,1.5,-2,0.25,0,0,0.6,0.8,\"\"\n" +
                       "3,18,60000,4,0.4,candidate,0,0,,,,,,,,\"too few matches, 3 of 20\"\n");
  const auto closures = read_closures(file);
  REQUIRE(closures.size() == 2);
  CHECK(closures[0].id == ClosureId{{3, 17}, {60000, 4}});
  CHECK(closures[0].stage == ClosureStage::kInlier);
  REQUIRE(closures[0].T_from_to);
  CHECK(closures[0].T_from_to->translation() == Eigen::Vector3d(1.5, -2.0, 0.25));
  CHECK(angle_of(closures[0].T_from_to->linear()) == Approx(2.0 * std::acos(0.8)));
  CHECK(closures[1].stage == ClosureStage::kCandidate);
  CHECK_FALSE(closures[1].T_from_to);
}

TEST_CASE("Keyframes take their true poses from the time they were made", "[closure_files]") {
  const TemporaryFolder folder;
  const auto file = folder.write("keyframes.csv",
                                 "robot,keyframe,stamp_ns,median_depth_m\n"
                                 "7,0,1000000000,2.5\n"
                                 "7,1,1525000000,0\n"
                                 "7,2,9000000000,3\n");
  const auto keyframes = read_keyframes(file);
  REQUIRE(keyframes.size() == 3);
  CHECK(keyframes[1].stamp == 1'525'000'000);
  const auto truth = sample(1.0, 20.0, 21, curve);  // to 2 s
  const auto placed = place_keyframes(keyframes, truth);
  REQUIRE(placed.size() == 2);  // the third lies beyond
  CHECK(placed[0].id == KeyframeId{7, 0});
  CHECK(placed[0].scene_depth_m == 2.5);
  CHECK(placed[0].T_world_body.isApprox(curve(1.0)));
  const double between_m = 0.002;  // chord against arc of 50 ms
  CHECK((placed[1].T_world_body.translation() - curve(1.525).translation()).norm() < between_m);
}

TEST_CASE("Broken closure files are named with their line", "[closure_files]") {
  const TemporaryFolder folder;
  const auto problem = [&](const std::string& rows) -> std::string {
    try {
      static_cast<void>(read_closures(folder.write("c.csv", kHeader + rows)));
    } catch (const ClosureFileError& error) {
      return error.what();
    }
    return {};
  };
  CHECK_THAT(problem("1,2,3\n"), Catch::Contains("c.csv line 2: 3 fields, expected 15"));
  CHECK_THAT(problem("1,2,3,4,0.5,married,0,0,,,,,,,,\n"),
             Catch::Contains("'married' is no stage of a closure"));
  CHECK_THAT(problem("1,2,3,4,0.5,verified,0,0,,,,,,,,\n"),
             Catch::Contains("a verified closure without a pose"));
  CHECK_THAT(problem("70000,2,3,4,0.5,candidate,0,0,,,,,,,,\n"),
             Catch::Contains("'70000' is not a number from 0 to 65535"));
  CHECK_THAT(problem("1,2,3,4,0.5,inlier,0,0,1,2,x,0,0,0,1,\n"),
             Catch::Contains("'x' is not a number"));
  CHECK_THAT(problem("1,2,3,4,0.5,inlier,0,0,1,2,3,0,0,0,2,\n"), Catch::Contains("unit length"));
  CHECK_THROWS_WITH(read_keyframes(folder.path() / "none.csv"), Catch::EndsWith("no such file"));
  CHECK(read_closures(folder.write("empty.csv", kHeader)).empty());
}

}  // namespace km
