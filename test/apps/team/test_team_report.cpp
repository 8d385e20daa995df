#include "apps/team/team_report.hpp"

#include <nlohmann/json.hpp>

#include "modules/mesh/mesh_file.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

std::string straight_line(double lift_m) {
  std::string text;
  for (int i = 0; i < 50; ++i)
    text += std::to_string(1 + i) + " " + std::to_string(i * i % 7) + " " + std::to_string(i) +
            " " + std::to_string(lift_m) + " 0 0 0 1\n";
  return text;
}

RunSummary summary_with(RobotId anchor, std::vector<RobotId> members) {
  RunSummary summary;
  summary.pgo.anchor = anchor;
  summary.pgo.members = std::move(members);
  return summary;
}

// Three walls of 3 m that meet in the origin, of classes 1, 2, 3; seen from inside.
LabelledMesh corner() {
  LabelledMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& [u, v] : {std::pair(0.0F, 0.0F), {3.0F, 0.0F}, {3.0F, 3.0F}, {0.0F, 3.0F}}) {
      Eigen::Vector3f p = Eigen::Vector3f::Zero();
      p[(axis + 1) % 3] = u;
      p[(axis + 2) % 3] = v;
      mesh.vertices.push_back(p);
      mesh.labels.push_back(static_cast<LabelId>(axis + 1));
    }
    mesh.faces.push_back({first, first + 1, first + 2});
    mesh.faces.push_back({first, first + 2, first + 3});
  }
  return mesh;
}

LabelledMesh moved(LabelledMesh mesh, const Eigen::Vector3d& by) {
  mesh.transform(make_pose(Eigen::Matrix3d::Identity(), by));
  return mesh;
}

// Robots a, b, ... with ids from 1 on, their results, and the truth: a straight line each.
struct Team {
  TemporaryFolder folder;
  TeamPlan plan;
  std::vector<std::string> notes;
  const Eigen::Vector3d shift = {0.2, -0.1, 0.1};  // shift of meshes in the team's frame

  explicit Team(int robots = 2) {
    plan.output = folder.path();
    for (int k = 0; k < robots; ++k) {
      RobotPlan& robot = plan.robots.emplace_back();
      robot.id = static_cast<RobotId>(k + 1);
      robot.name = static_cast<char>('a' + k);
      robot.graph = "g.csv";
      robot.truth = folder.write(robot.name + ".tum", straight_line(0.0));
      fs::create_directories(folder.path() / robot.name);
    }
  }
  void leave(const std::string& robot, const RunSummary& summary, double odometry_lift_m = 0.0,
             double optimized_lift_m = 0.0) const {
    folder.write(robot + "/summary.json", json_text(summary));
    folder.write(robot + "/odometry.tum", straight_line(odometry_lift_m));
    folder.write(robot + "/live.tum", straight_line(odometry_lift_m));
    folder.write(robot + "/optimized.tum", straight_line(optimized_lift_m));
  }
  void leave(const std::string& robot, const char* file, const LabelledMesh& mesh) const {
    write_mesh(folder.path() / robot / file, moved(mesh, -shift));
  }
  TeamResult collect() const {
    return collect_results(plan, std::vector<RobotRun>(plan.robots.size()));
  }
  TeamMeshes meshes() {
    return collect_meshes(plan, make_pose(Eigen::Matrix3d::Identity(), shift), notes);
  }
};

// Robot a has all results, b failed and left only its last words.
struct HalfTeam : Team {
  RunSummary summary = summary_with(1, {1, 7});

  HalfTeam() {
    summary.robot = 1;
    summary.name = "a";
    summary.keyframes = 12;
    summary.frames = 150;
    summary.closures = {9, 5, 4};
    summary.pgo.round = 33;
    summary.traffic = {{"place_recognition", 2000},
                       {"geometric_verification", 3000000},
                       {"pgo", 400},
                       {"map", 7000000}};
    summary.exit_reason = "done";
    leave("a", summary, 0.5);
  }
  TeamResult collect() const {
    return collect_results(plan, {{{0, 0}, {}}, {{3, 0}, {"error: no luck"}}});
  }
};

}  // namespace

TEST_CASE("A robot without results leaves a note, the others are judged") {
  const TeamResult team = HalfTeam().collect();
  REQUIRE(team.robots.size() == 2);
  CHECK(team.robots[0].notes.empty());
  REQUIRE(team.robots[0].odometry);
  CHECK(team.robots[0].odometry->position_m.rmse < 1e-9);
  REQUIRE(team.optimized);
  CHECK(team.optimized->robots.size() == 1);
  REQUIRE(team.live);
  CHECK(team.live->joint.poses == 50);
  CHECK(team.robots[1].notes.size() == 3);
  CHECK_FALSE(team.robots[1].odometry);
}

TEST_CASE(
    "Damaged live poses are noted, and those of a robot that joined at the end are not missed") {
  const HalfTeam half;
  half.folder.write("a/live.tum", "1.0 0 0 0 0 0 0\n");
  const TeamResult damaged = half.collect();
  CHECK_FALSE(damaged.live);
  REQUIRE(damaged.robots[0].notes.size() == 1);
  CHECK_THAT(damaged.robots[0].notes[0], Contains("live.tum"));
  half.folder.write("a/live.tum", "");
  const TeamResult late = half.collect();
  CHECK_FALSE(late.live);
  CHECK(late.robots[0].notes.empty());
  CHECK(late.optimized);
}

TEST_CASE("The tables show results, failures and last words, in 120 columns") {
  const std::string text = to_table(HalfTeam().collect());
  for (const char* expected :
       {"team, one frame", "live, one frame", "100.0%", "FAILED, exit code 3",
        "b failed, exit code 3; its last words:\n  error: no luck", "2.0 kB", "3.0 MB", "400 B",
        "2 robots", "aligned with the truth robot by robot"}) {
    CAPTURE(text, expected);
    CHECK_THAT(text, Contains(expected));
  }
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    CAPTURE(line);
    CHECK((line.size() <= 120 || line.starts_with("note: ")));
  }
}

TEST_CASE("A robot without results is reported by its last words only") {
  TeamResult team = HalfTeam().collect();
  CHECK_THAT(to_table(team), !Contains("no such file"));
  team.robots[0].summary.reset();
  for (RobotResult& robot : team.robots) robot.run = {{1, 0}, {"no such key", ""}};
  CHECK(to_table(team) == "a, b failed, exit code 1; their last words:\n  no such key\n");
}

TEST_CASE("The bytes of robots are compared with a server that receives all keyframes") {
  TeamResult team = HalfTeam().collect();
  team.robots[0].summary->keyframes = 1000;  // each has 40 kB, and the robot has sent 3 MB
  CHECK_THAT(to_table(team), Contains("would receive\n40.0 MB, of which the robots send 7.5 %.\n"));
  team.robots[0].summary->peer_keyframes = {.keyframes = 10, .keypoints = 1500};
  CHECK_THAT(
      to_table(team),
      Contains("With 150, as many as a robot receives of\na keyframe, of 16.6 bytes, as robots "
               "pack them, it would receive 2.5 MB, of which the robots send 120.6 %.\n"));
  team.robots[0].summary->keyframes = 0;
  CHECK_THAT(to_table(team), !Contains("A server"));
}

TEST_CASE("Errors and frames left out are stated with their remedy, other findings are not") {
  TeamResult team = HalfTeam().collect();
  team.robots[0].summary->findings = {
      {.id = "vocabulary.other",
       .severity = Severity::kError,
       .what = "a: 7 keyframes of b have another vocabulary",
       .means = "none can be compared",
       .to_do = "use one run.vocabulary on all robots"},
      {"frames.skipped", Severity::kWarning, "a: 80 frames skipped, 80 %", "", "use --rate auto"},
      {.id = "memory.grows", .severity = Severity::kWarning, .what = "a: memory grows"}};
  CHECK_THAT(to_table(team),
             Contains("error: a: 7 keyframes of b have another vocabulary: use one "
                      "run.vocabulary on all robots\n") &&
                 Contains("warning: a: 80 frames skipped, 80 %: use --rate auto\n") &&
                 !Contains("memory grows"));
}

TEST_CASE("The JSON of a run holds every robot, with all of its summary") {
  const HalfTeam half;
  const Json json = half.collect(), summary = half.summary;
  for (const auto& [key, value] : summary.items()) {
    CAPTURE(key);
    CHECK(json["robots"][0][key] == value);
  }
  CHECK(json["robots"][0]["odometry"]["pairs"] == 50);
  CHECK(json["robots"][1]["exit_code"] == 3);
  CHECK(json["robots"][1]["robot"] == 2);
  CHECK(json["optimized"]["robots"].size() == 1);
  CHECK_FALSE(json.contains("closures"));
}

TEST_CASE("One half of a divided team is in the team's frame, and the other half is noted") {
  std::vector<RobotResult> robots(5);
  for (const RobotId id : {RobotId{0}, RobotId{1}, RobotId{2}, RobotId{3}}) {
    const RobotId first = id < 2 ? RobotId{0} : RobotId{2};
    robots[id].plan.id = id;
    robots[id].summary = summary_with(first, {first, static_cast<RobotId>(first + 1)});
  }
  find_team_frame(robots);
  CHECK(robots[0].in_team_frame);
  CHECK(robots[1].notes.empty());
  CHECK_FALSE(robots[2].in_team_frame);
  CHECK_THAT(robots[3].notes.at(0), StartsWith("ended in the frame of robot 2"));
  CHECK(robots[4].in_team_frame);  // the frame is unknown without a summary
}

TEST_CASE("A robot that never joined is not judged in the team's frame") {
  const Team three(3);
  three.leave("a", summary_with(1, {1, 2}));
  three.leave("b", summary_with(1, {1, 2}));
  three.leave("c", summary_with(0, {}), 50.0, 50.0);
  const TeamResult team = three.collect();
  REQUIRE(team.optimized);
  CHECK(team.optimized->robots.size() == 2);
  CHECK(team.optimized->joint.position_m.rmse < 1e-9);  // with c it would be tens of metres
  CHECK(team.robots[2].odometry);
  CHECK_THAT(to_table(team), Contains("note: c: never joined the others"));
}

TEST_CASE("Closures are judged in the robots' common world") {
  const EurocFolder recording;  // for its camera
  Team two;
  const std::string closures =
      "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,"
      "tx,ty,tz,qx,qy,qz,qw,s1,s2,s3,s4,s5,s6,reason\n";
  for (RobotPlan& robot : two.plan.robots) {
    robot.graph.clear();
    robot.dataset = recording.root();
    robot.truth = two.folder.write(robot.name + ".tum", straight_line(0.1 * (robot.id - 1)));
    two.folder.write(robot.name + "/keyframes.csv", "robot,keyframe,stamp_ns,median_depth_m\n" +
                                                        std::to_string(robot.id) +
                                                        ",0,5000000000,20\n");
  }
  two.folder.write("a/loop_closures.csv",
                   closures + "1,0,2,0,0.5,inlier,80,60,0,0,0.1,0,0,0,1,1,1,1,1,1,1,\"\"\n");
  two.folder.write("b/loop_closures.csv",
                   closures + "2,0,1,0,0.5,verified,80,60,0,3,0,0,0,0,1,.1,.1,.1,.1,.1,.1,\"\"\n");
  const TeamResult team = two.collect();
  REQUIRE(team.closures);
  CHECK(team.closures->true_pairs == 1);
  CHECK(team.closures->candidates.correct == 2);
  CHECK(team.closures->verified.judged == 2);
  CHECK(team.closures->verified.correct == 1);
  CHECK(team.closures->inliers.precision() == 1.0);
  CHECK(team.notes.empty());
  CHECK_THAT(to_table(team), Contains("1 pairs of keyframes of two robots"));
  CHECK(Json(team)["closures"]["inliers"]["pair_recall"] == 1.0);

  fs::remove(two.folder.path() / "b/loop_closures.csv");
  const TeamResult part = two.collect();
  REQUIRE(part.closures);
  CHECK(part.closures->unjudged == 1);
  REQUIRE(part.notes.size() == 1);
  CHECK_THAT(part.notes[0], StartsWith("b: closures are not judged: "));
}

TEST_CASE("Meshes are compared with the true one, before and after their correction") {
  Team team;
  team.plan.truth_mesh = team.folder.path() / "world.ply";
  write_mesh(team.plan.truth_mesh, corner());
  LabelledMesh mislabelled = moved(corner(), {0.1, 0.1, 0.1});
  mislabelled.labels.assign(mislabelled.labels.size(), 2);
  team.leave("a", "mesh.ply", corner());
  team.leave("b", "mesh.ply", mislabelled);
  team.leave("a", "mesh_optimized.ply", corner());

  TeamResult result = HalfTeam().collect();
  SECTION("all there") {
    team.leave("b", "mesh_optimized.ply", corner());
    const TeamMeshes meshes = result.meshes = team.meshes();
    CHECK(team.notes.empty());
    REQUIRE(meshes.errors.has_value());
    const auto& [before, after] = *meshes.errors;
    REQUIRE(before.robots.size() == 2);
    constexpr double kSampling_m = 0.02;  // points 3 cm apart
    CHECK(after.merged.truth.point.mean_m < kSampling_m);
    // One transform for both: whatever it is, two meshes 17 cm apart cannot both fit.
    CHECK(before.robots[0].truth.point.mean_m + before.robots[1].truth.point.mean_m > 0.05);
    CHECK(after.robots[1].truth.labels.total().accuracy() > 0.97);
    CHECK(before.robots[1].truth.labels.total().accuracy() < 0.4);
    CHECK(meshes.merged.faces.size() == 2 * corner().faces.size());
    for (std::size_t i = 0; i < corner().vertices.size(); ++i)  // as floats
      CHECK((meshes.merged.vertices[i] - corner().vertices[i]).norm() < 1e-5F);
  }
  SECTION("a corrected one missing") {
    result.meshes = team.meshes();
    CHECK(team.notes ==
          std::vector<std::string>{"b left a mesh, but none corrected: not compared"});
    REQUIRE(result.meshes.errors.has_value());
    CHECK(result.meshes.errors->before.robots.size() == 1);
    CHECK(result.meshes.errors->after.robots.size() == 1);
  }
  const std::string table = to_table(result);
  const std::string rows = table.substr(table.find("\nmesh "));
  CHECK_THAT(rows,
             Contains("odometry: error [m]") && Contains("\na ") && Contains("\nteam, one frame"));
  CHECK(Json(result)["optimized_meshes"]["merged"]["truth_to_estimate"]["labels"]["accuracy"] >
        0.97);
}

TEST_CASE("Meshes without a true one are merged, and broken ones named") {
  Team team;
  team.leave("a", "mesh_optimized.ply", corner());
  team.folder.write("b/mesh_optimized.ply", "ply, or not");
  const TeamMeshes meshes = team.meshes();
  CHECK(meshes.merged.faces.size() == corner().faces.size());
  CHECK_FALSE(meshes.errors.has_value());
  REQUIRE(team.notes.size() == 1);
  CHECK_THAT(team.notes[0], Contains("b/mesh_optimized.ply"));
}

}  // namespace km
