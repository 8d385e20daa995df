#include <yaml-cpp/yaml.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

// apps/demo from end to end: a world is rendered, and three robots find themselves in it over DDS.

namespace km {

TEST_CASE("The demo joins three robots of a simulated world into one frame", "[demo][slow]") {
  constexpr std::size_t kFrames = 80;   // 8 s at 10 Hz
  constexpr double kMaxError_m = 0.3;   // robots in frames of their own are a metre off and more
  const TemporaryFolder folder;
  const auto demo = run_command("apps/demo --short --rate max --programs " KM_BIN_DIR " --output " +
                                folder.path().string());
  CAPTURE(demo.output);
  REQUIRE(demo.exit_code == 0);
  CHECK_THAT(demo.output, Catch::Contains("240 of 240 frames, 100 %") &&
                              Catch::Contains("8 s of recording each, as fast as this") &&
                              Catch::Contains("team, one frame") &&
                              Catch::Contains("To look at, in " + folder.path().string()));

  const YAML::Node team = YAML::Load(folder.read("team.json"));  // JSON is YAML
  REQUIRE(team["robots"].size() == 3);
  for (const YAML::Node& robot : team["robots"]) {
    CHECK(robot["frames"].as<std::size_t>() == kFrames);
    CHECK(robot["pgo"]["members"].size() == 3);
  }
  // The room is 3 m high: a mesh that is half a metre off would fit nothing.
  const YAML::Node mesh = team["optimized_meshes"]["merged"];
  CHECK(mesh["coverage"].as<double>() > 0.3);
  CHECK(mesh["truth_to_estimate"]["point"]["median_m"].as<double>() < 0.1);
  CHECK(mesh["truth_to_estimate"]["labels"]["accuracy"].as<double>() > 0.7);
  CHECK(team["optimized"]["joint"]["position_m"]["rmse"].as<double>() < kMaxError_m);
  for (const char* file : {"report.html", "team_mesh.ply", "team_mesh.png", "robot0/mesh.ply",
                           "robot0/mesh_optimized.ply", "robot0/label_palette.csv",
                           "robot0/optimized.tum", "robot0/loop_closures.csv", "robot0/traffic.csv",
                           "robot0/robot.log", "robot0/config.yaml", "world_short/README.md"})
    CHECK(std::filesystem::exists(folder.path() / file));
}

TEST_CASE("The demo says how long its world is", "[demo]") {
  const auto help = run_command("apps/demo --help");
  CHECK(help.exit_code == 0);
  CHECK_THAT(help.output, Catch::Contains("The simulated world is 25 s long, with --short 8 s"));
}

TEST_CASE("The demo says how a bag is played", "[demo]") {
  const TemporaryFolder folder;
  const std::string bag = GENERATE("walk.bag", "walk.mcap", "ros2/metadata.yaml", "ros2/walk.db3");
  std::filesystem::path path = folder.write(bag, "x");
  if (bag.starts_with("ros2/m")) path = path.parent_path();
  const auto demo = run_command("apps/demo " + path.string());
  CHECK(demo.exit_code == 1);
  CHECK_THAT(demo.output, Catch::Contains("--inspect " + path.string() + " rig.yaml") &&
                              Catch::Contains("--dataset " + path.string() + " --rig rig.yaml"));
}

TEST_CASE("The demo refuses what it cannot use", "[demo]") {
  const auto refusal = [](const std::string& arguments) {
    const auto result = run_command("apps/demo " + arguments);
    CHECK(result.exit_code != 0);
    return result.output;
  };
  CHECK_THAT(refusal("/no/such/folder"), Catch::Contains("no such folder: /no/such/folder"));
  CHECK_THAT(refusal("--robots none"), Catch::Contains("--robots none is not a number"));
  for (const std::string rate : {"fast", "0", "-1", "1.0x", ""})
    CHECK_THAT(refusal("--rate '" + rate + "'"),
               Catch::StartsWith("demo: --rate " + rate + " is neither a positive number nor max"));
  CHECK_THAT(refusal("--output"), Catch::Contains("--output needs a value"));
  CHECK_THAT(refusal("--fast"), Catch::Contains("unknown option --fast"));
  CHECK_THAT(refusal("--programs /nope"),
             Catch::StartsWith("demo: --programs: no such folder: /nope"));
  CHECK_THAT(refusal("--programs config"),
             Catch::StartsWith("demo: --programs: no kimera_multi_robot in "));
  CHECK_THAT(refusal("--short config"), Catch::Contains("--short is for the simulated world"));
  CHECK_THAT(refusal("--output /proc/none --programs " KM_BIN_DIR),
             Catch::Contains("demo: --output /proc/none: cannot be written to"));
  CHECK_THAT(refusal("config --programs " KM_BIN_DIR), Catch::Contains("cam0/data.csv is missing"));
}

}  // namespace km
