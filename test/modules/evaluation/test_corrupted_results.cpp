#include <nlohmann/json.hpp>

#include "modules/core/io/input_file.hpp"
#include "modules/core/io/json.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "test/support/corrupted_input.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

std::string tum() {
  std::string text = "# t x y z qx qy qz qw\n";
  for (int i = 0; i < 30; ++i)
    text += "1403636" + std::to_string(580 + i) + ".83856 " + std::to_string(i) + ".688 " +
            std::to_string(i % 7) + ".25 0.78 0 0 0.6 0.8\n";
  return text;
}

std::string euroc() {
  std::string text = "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z\n";
  for (int i = 0; i < 30; ++i)
    text += "1403636" + std::to_string(580 + i) + "838560000," + std::to_string(i) + ".688," +
            std::to_string(i % 5) + ".25,0.78,0.8,0,0,0.6\n";
  return text;
}

}  // namespace

TEST_CASE("A corrupted trajectory is refused with its line or has finite errors") {
  const std::string good = GENERATE(tum(), euroc());
  const auto truth = parse_trajectory(tum(), "truth");
  check_corrupted<InputFileError>(good, "corrupted.tum", [&](const std::string& text) {
    const auto poses = parse_trajectory(text, "corrupted.tum");
    for (std::size_t i = 0; i < poses.size(); ++i) {
      CHECK(poses[i].T.matrix().allFinite());
      if (i > 0) CHECK(poses[i - 1].stamp < poses[i].stamp);
    }
    const TrajectoryInput input{"corrupted", truth, poses, std::nullopt};
    try {
      const auto error = trajectory_error({&input, 1});
      CHECK(std::isfinite(error.joint.position_m.rmse));
      CHECK(std::isfinite(error.joint.rotation_deg.rmse));
    } catch (const std::invalid_argument&) {  // nothing to compare
    }
  });
}

TEST_CASE("Corrupted tables of a run are refused with file and line") {
  const TemporaryFolder folder;
  SECTION("keyframes.csv") {
    check_corrupted<InputFileError>(
        "robot,index,stamp_ns,scene_depth_m\n0,0,1403636580838555392,2.5\n0,1,1403636581838555392,"
        "3\n"
        "0,2,1403636582838555392,0\n",
        "keyframes.csv", [&](const std::string& text) {
          for (const auto& keyframe : read_keyframes(folder.write("keyframes.csv", text)))
            CHECK(std::isfinite(keyframe.scene_depth_m));
        });
  }
  SECTION("loop_closures.csv") {
    check_corrupted<InputFileError>(
        "robot_a,index_a,robot_b,index_b,similarity,stage,matches,inliers,x,y,z,qx,qy,qz,qw,"
        "s1,s2,s3,s4,s5,s6,reason\n"
        "0,1,1,7,0.5,inlier,40,30,1.5,2.5,3.5,0,0,0.6,0.8,0.01,0.01,0.01,0.1,0.1,0.1,\n"
        "0,2,1,9,0.25,candidate,0,0,,,,,,,,,,,,,,\"far, apart\"\n",
        "loop_closures.csv", [&](const std::string& text) {
          for (const auto& closure : read_closures(folder.write("loop_closures.csv", text)))
            if (closure.T_from_to) CHECK(closure.T_from_to->matrix().allFinite());
        });
  }
  SECTION("JSON") {
    check_corrupted<std::runtime_error>(
        "{\n\"frames\": 12,\n\"pgo\": {\"cost\": 1.5, \"members\": [0, 1]},\n\"end\": "
        "\"done\"\n}\n",
        "summary.json",
        [&](const std::string& text) { (void)read_json(folder.write("summary.json", text)); });
  }
}

TEST_CASE("A path that is no file of results is refused by name") {
  check_no_files<InputFileError>(".tum", [](const auto& place) { (void)read_trajectory(place); });
  check_no_files<InputFileError>(".csv", [](const auto& place) { (void)read_keyframes(place); });
  check_no_files<std::runtime_error>(".json", [](const auto& place) { (void)read_json(place); });
}

}  // namespace km
