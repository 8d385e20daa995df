#include <yaml-cpp/yaml.h>

#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/map_2d/map_2d.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/sensors/text_file.hpp"
#include "test/support/command.hpp"
#include "test/support/demo_world.hpp"
#include "test/support/nav2_map.hpp"
#include "test/support/planned_path.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

// apps/demo from end to end: a world is rendered, and three robots localise themselves in it over
// DDS.

namespace km {
namespace {

// Cells of the truth that are `value` within `reach` cells of a point.
bool is_near(const OccupancyGrid& truth, const Eigen::Vector2d& point, std::int8_t value,
             int reach) {
  for (int y = -reach; y <= reach; ++y)
    for (int x = -reach; x <= reach; ++x)
      if (truth.at(point + truth.resolution_m * Eigen::Vector2d(x, y)) == value) return true;
  return false;
}

// Compares the 2D map of robot 0 with that of the true room, moved to the frame of the team, whose
// anchor is robot 0.
void check_map_2d(const fs::path& robot, const fs::path& world) {
  const StampedPose first = read_trajectory(robot / "optimized.tum").front();
  const auto truth_poses =
      read_trajectory(world / "robot0/mav0/state_groundtruth_estimate0/data.csv");
  const auto T_truth_body = pose_at(truth_poses, first.stamp, 0.1, 0.05);
  REQUIRE(T_truth_body);
  LabelledMesh room = read_mesh(world / "world.ply");
  room.transform(first.T * T_truth_body->inverse());
  const LabelPalette palette =
      parse_label_palette(read_file(world / "label_palette.csv"), "label_palette.csv");
  const Map2dResult truth = make_map_2d({}, {room, palette});
  REQUIRE(truth.status == Map2dStatus::kMade);

  const OccupancyGrid map =
      load_nav2_map(read_file(robot / "map.yaml"), read_file(robot / "map.pgm"));
  constexpr int kReach = 4;  // cells of 5 cm: errors of pose and mesh, and a voxel
  double occupied = 0, wrong_occupied = 0, free = 0, wrong_free = 0;
  std::vector<Eigen::Vector2d> places;
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const Eigen::Vector2d point =
          map.origin + map.resolution_m * Eigen::Vector2d(x + 0.5, y + 0.5);
      const std::int8_t cell = map.cells[map.index(x, y)];
      if (cell == OccupancyGrid::kOccupied) {
        ++occupied;
        wrong_occupied += is_near(truth.grid, point, OccupancyGrid::kOccupied, kReach) ? 0 : 1;
      } else if (cell == OccupancyGrid::kFree) {
        if (static_cast<int>(free++) % 500 == 0) places.push_back(point);
        wrong_free += is_near(truth.grid, point, OccupancyGrid::kFree, kReach) ? 0 : 1;
      }
    }
  CAPTURE(occupied, wrong_occupied, free, wrong_free);
  CHECK(occupied > 500);
  CHECK(free > 5000);
  CHECK(wrong_occupied < 0.05 * occupied);
  CHECK(wrong_free < 0.02 * free);

  std::size_t paths = 0, collisions = 0;
  for (std::size_t k = 1; k < places.size(); ++k) {
    const std::vector<Eigen::Vector2d> path = planned_path(map, places[k - 1], places[k]);
    paths += path.empty() ? 0 : 1;
    collisions += std::ranges::any_of(path, [&](const Eigen::Vector2d& point) {
      return truth.grid.at(point) == OccupancyGrid::kOccupied;
    });
  }
  CHECK(paths > 5);  // ends may be near an obstacle
  CHECK(collisions == 0);
}

}  // namespace

TEST_CASE("The demo joins three robots of a simulated world into one frame", "[demo_world]") {
  constexpr std::size_t kFrames = 80;  // 8 s at 10 Hz
  constexpr double kMaxError_m = 0.3;  // robots in frames of their own are a metre off and more
  const TemporaryFolder folder;
  const auto demo = succeeded(run_command(
      "apps/demo --short --rate max --programs " KM_BIN_DIR " --output " + folder.path().string()));
  keep_demo_world(folder.path() / "world_short");
  CHECK_THAT(demo.output, Contains("240 of 240 frames, 100 %") &&
                              Contains("8 s of recording each, as fast as this") &&
                              Contains("team, one frame") &&
                              Contains("To look at, in " + folder.path().string()));

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
  // Objects arrive from the other robots, and copies of an object are one.
  std::size_t shared = 0;
  for (const YAML::Node& object : YAML::Load(folder.read("robot0/objects.json"))["objects"])
    shared += object["robots"].size() > 1 ? 1 : 0;
  CHECK(shared > 0);
  check_map_2d(folder.path() / "robot0", folder.path() / "world_short");
  for (const char* file :
       {"report.html", "team_mesh.ply", "team_mesh.png", "robot0/mesh.ply",
        "robot0/mesh_optimized.ply", "robot0/label_palette.csv", "robot0/optimized.tum",
        "robot0/loop_closures.csv", "robot0/traffic.csv", "robot0/robot.log", "robot0/config.yaml"})
    CHECK(fs::exists(folder.path() / file));
}

TEST_CASE("The demo prints the commands to play a bag, to be pasted") {
  const TemporaryFolder folder;
  const auto [file, dataset, pasted] = GENERATE(table<std::string, std::string, std::string>({
      {"walk.bag", "walk.bag", "walk.bag"},
      {"walk.mcap", "walk.mcap", "walk.mcap"},
      {"walk.db3", "walk.db3", "walk.db3"},
      {"ros2/metadata.yaml", "ros2", "ros2"},
      {"ros2/walk_0.db3", "ros2", "ros2"},
      {"ros2/walk_0.mcap", "ros2", "ros2"},
      {"a walk.bag", "a walk.bag", "a\\ walk.bag"},
  }));
  CAPTURE(file, dataset);
  folder.write(file, "x");
  const std::string path = (folder.path() / dataset).string();
  const auto demo = run_command("apps/demo --programs " KM_BIN_DIR " '" + path + '\'');
  CHECK(demo.exit_code == 1);
  const std::string robot = KM_BIN_DIR "/kimera_multi_robot ",
                    name = (folder.path() / pasted).string();
  CHECK_THAT(demo.output, StartsWith("demo: " + path + " is a bag of ROS.") &&
                              Contains(robot + "--inspect " + name + " rig.yaml\n") &&
                              Contains(robot + "--robot 0 --dataset " + name +
                                       " --rig rig.yaml --output results/robot0\n"));
}

// A recording of 10 s, and programs that print their command lines.
struct StubbedDemo {
  TemporaryFolder folder;

  StubbedDemo() {
    std::string frames = "#timestamp [ns],filename\n";
    for (int i = 0; i <= 100; ++i)
      frames += std::to_string(1'000'000'000'000 + i * 100'000'000LL) + ",x.png\n";
    folder.write("recording/mav0/cam0/data.csv", frames);
    folder.write("recording/walk.mcap", "x");  // a bag in an ASL folder
    for (const char* program : {"robot", "team", "evaluate"}) add(program, "echo \"$0 $*\"");
  }
  void add(const std::string& program, const std::string& script) const {
    const auto file = folder.write("bin/kimera_multi_" + program, "#!/bin/sh\n" + script + '\n');
    fs::permissions(file, fs::perms::owner_all);
  }
  CommandResult run(const std::string& arguments) const {
    const std::string root = folder.path().string() + '/';
    return run_command("apps/demo " + root + "recording --programs " + root + "bin --output " +
                       root + "out " + arguments);
  }
};

TEST_CASE("The demo builds and draws a map of a recording with --map only") {
  const StubbedDemo demo;
  const std::string settings = "--set mapping.mode=metric";
  const CommandResult without = succeeded(demo.run(""));
  CHECK_THAT(without.output, !Contains(settings) && !Contains("team_mesh.png"));

  const CommandResult none = demo.run("--map");
  CAPTURE(none.output);
  CHECK(none.exit_code == 1);
  CHECK_THAT(none.output, Contains("report.html") && !Contains("team_mesh.png ") &&
                              EndsWith("demo: the team built no mesh: the notes above and "
                                       "robot0/robot.log have the reason\n"));

  demo.folder.write(
      "recording/mav0/cam0/sensor.yaml",
      "T_BS:\n  data: [0, 0, 1, 0.1,\n  -1, 0, 0, 0,\n  0, -1, 0, 0,\n  0, 0, 0, 1]\n");
  const std::string out = (demo.folder.path() / "out/").string();
  demo.add("team", "echo \"$*\"; cd '" + out +
                       "' && mkdir -p robot0 && : >team_mesh.ply && echo 5 1 2 3 0 0 0 1 "
                       ">robot0/optimized.tum");
  const CommandResult with = succeeded(demo.run("--map"));
  CHECK_THAT(with.output, Contains("/out/team.json -- " + settings + '\n') &&
                              Contains("team_mesh.png ") && Contains("team_mesh.ply "));
  const std::string render = demo.folder.read("out/render.log");
  CHECK_THAT(render, Contains("/out/team_mesh.ply --output ") && !Contains("--palette") &&
                         Contains("--view=0.60,2.00,3.00,0.0,0.0 "));

  fs::remove(demo.folder.path() / "bin/kimera_multi_evaluate");
  CHECK(demo.run("").exit_code == 0);
  CHECK_THAT(demo.run("--map").output,
             StartsWith("demo: --programs: no kimera_multi_evaluate in "));
}

TEST_CASE("The demo lets robots be watched with --view only") {
  const StubbedDemo demo;
  demo.add("viewer", "echo Open http://here");
  const CommandResult without = demo.run("");
  CHECK(without.exit_code == 0);
  CHECK_THAT(without.output, !Contains("--view"));
  const CommandResult with = succeeded(demo.run("--view"));
  CHECK_THAT(with.output, Contains("To watch the team, open http://here") &&
                              Contains("/kimera_multi_team --config") && Contains(" --view\n"));
}

TEST_CASE("The demo refuses unusable input") {
  const auto refusal = [](const std::string& arguments, int exit_code = 1) {
    const auto result = run_command("apps/demo " + arguments);
    CHECK(result.exit_code == exit_code);
    return result.output;
  };
  CHECK_THAT(refusal("/no/such/folder"), Contains("no such folder: /no/such/folder"));
  const TemporaryFolder recordings;
  const fs::path one = recordings.path() / "one";
  fs::create_directories(one / "mav0");
  CHECK_THAT(refusal(recordings.path().string()),
             Contains("is a folder of recordings: name one, such as " + one.string() + "\n"));
  CHECK_THAT(refusal(one.string()), Contains("cam0/data.csv is missing"));
  CHECK_THAT(refusal("--robots none", 2), Contains("--robots none is not a number"));
  for (const std::string rate : {"fast", "0", "-1", "1.0x", ""})
    CHECK_THAT(refusal("--rate '" + rate + "'", 2),
               StartsWith("demo: --rate " + rate + " is neither a positive number nor max"));
  CHECK_THAT(refusal("--output", 2), Contains("--output needs a value"));
  CHECK_THAT(refusal("--fast", 2), Contains("unknown option --fast"));
  CHECK_THAT(refusal("--programs /nope"), StartsWith("demo: --programs: no such folder: /nope"));
  CHECK_THAT(refusal("--programs config"),
             StartsWith("demo: --programs: no kimera_multi_robot in "));
  CHECK_THAT(refusal("--short config", 2), Contains("--short is for the simulated world"));
  CHECK_THAT(refusal("--output /proc/none --programs " KM_BIN_DIR),
             Contains("demo: --output /proc/none: cannot be written to"));
  CHECK_THAT(refusal("config --programs " KM_BIN_DIR), Contains("cam0/data.csv is missing"));
}

}  // namespace km
