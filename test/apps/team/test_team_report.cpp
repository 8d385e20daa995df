#include "apps/team/team_report.hpp"

#include <catch2/catch.hpp>
#include <sstream>

#include "apps/team/team_frame.hpp"
#include "apps/team/text_table.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

constexpr const char* kSummary = R"({
  "robot": 4, "name": "a", "keyframes": 12, "frames": 150, "frames_skipped": 1,
  "closures": {"candidates": 9, "verified": 5, "inliers": 4},
  "pgo": {"rounds": 33, "seconds": 0.5, "cost": 1.25, "gradient_norm": 0.1, "anchor": 4,
          "settled": true, "members": [4, 7]},
  "traffic": {"place_recognition": 2000, "geometric_verification": 3000000, "pgo": 400, "other": 5},
  "exit_reason": "done"
})";

std::string straight_line(double lift_m) {
  std::string text;
  for (int i = 0; i < 50; ++i)
    text += std::to_string(1 + i) + " " + std::to_string(i * i % 7) + " " + std::to_string(i) +
            " " + std::to_string(lift_m) + " 0 0 0 1\n";
  return text;
}

// Two robots; `a` with all its files, `b` with none.
TeamResult example(const TemporaryFolder& folder) {
  TeamPlan plan;
  plan.output = folder.path();
  for (const char* name : {"a", "b"}) {
    RobotPlan robot;
    robot.name = name;
    robot.id = 4;
    robot.graph = "g.csv";
    robot.truth = folder.write("truth.tum", straight_line(0.0));
    plan.robots.push_back(robot);
  }
  folder.write("a/summary.json", kSummary);
  folder.write("a/odometry.tum", straight_line(0.5));
  folder.write("a/optimized.tum", straight_line(0.0));
  return collect_results(plan, {{{0, 0}, {}}, {{3, 0}, {"error: no luck"}}});
}

}  // namespace

TEST_CASE("A summary is read with its parts", "[team]") {
  const TemporaryFolder folder;
  const RobotSummary summary = read_summary(folder.write("summary.json", kSummary));
  CHECK(summary.keyframes == 12);
  CHECK(summary.frames == 150);
  CHECK(summary.frames_skipped == 1);
  CHECK(summary.closure_candidates == 9);
  CHECK(summary.closures_verified == 5);
  CHECK(summary.closures_inlier == 4);
  CHECK(summary.pgo_rounds == 33);
  CHECK(summary.pgo_seconds == 0.5);
  CHECK(summary.pgo_cost == 1.25);
  CHECK(summary.pgo_anchor == RobotId{4});
  CHECK(summary.pgo_members == std::vector<RobotId>{4, 7});
  CHECK(summary.traffic_bytes.at("geometric_verification") == 3000000);
  CHECK(summary.exit_reason == "done");
}

TEST_CASE("A summary that is missing or broken is named", "[team]") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_summary(folder.path() / "x.json"), Catch::EndsWith("no such file"));
  CHECK_THROWS_WITH(read_summary(folder.write("y.json", "[1, 2")), Catch::Contains("y.json"));
  CHECK_THROWS_WITH(read_summary(folder.write("z.json", "7")),
                    Catch::Contains("not a JSON object"));
  CHECK(read_summary(folder.write("empty.json", "{}")).keyframes == 0);
}

TEST_CASE("A robot without results leaves a note, the others are judged", "[team]") {
  const TemporaryFolder folder;
  const TeamResult team = example(folder);
  REQUIRE(team.robots.size() == 2);
  CHECK(team.robots[0].notes.empty());
  REQUIRE(team.robots[0].odometry);
  CHECK(team.robots[0].odometry->position_m.rmse < 1e-9);
  REQUIRE(team.optimized);
  CHECK(team.optimized->robots.size() == 1);
  CHECK(team.robots[1].notes.size() == 3);
  CHECK_FALSE(team.robots[1].odometry);
}

TEST_CASE("The tables show results, failures and last words", "[team]") {
  const TemporaryFolder folder;
  const std::string text = to_table(example(folder));
  for (const char* expected :
       {"team, one frame", "100.0%", "FAILED, exit code 3",
        "b failed, exit code 3; its last words:\n  error: no luck", "2.0 kB", "3.0 MB", "400 B",
        "2 robots", "aligned with the truth robot by robot"}) {
    CAPTURE(text, expected);
    CHECK_THAT(text, Catch::Contains(expected));
  }
}

TEST_CASE("A robot that left nothing is told of by its last words only", "[team]") {
  const TemporaryFolder folder;
  TeamResult team = example(folder);
  CHECK_THAT(to_table(team), !Catch::Contains("no such file"));
  team.robots[0].summary.reset();
  for (RobotResult& robot : team.robots) robot.run = {{1, 0}, {"no such key", ""}};
  CHECK(to_table(team) == "a, b failed, exit code 1; their last words:\n  no such key\n");
}

// Robots that end with these anchors and members.
std::vector<RobotResult> ended(const std::vector<std::pair<RobotId, std::vector<RobotId>>>& ends) {
  std::vector<RobotResult> robots(ends.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    robots[i].plan.id = static_cast<RobotId>(i);
    robots[i].summary.emplace();
    robots[i].summary->pgo_anchor = ends[i].first;
    robots[i].summary->pgo_members = ends[i].second;
  }
  return robots;
}

TEST_CASE("Robots outside the team's frame are found and noted", "[team]") {
  auto robots = ended({{0, {0}}, {1, {1, 2}}, {1, {1, 2}}, {0, {}}});
  robots.emplace_back();  // without a summary nobody knows
  find_team_frame(robots);
  CHECK_FALSE(robots[0].in_team_frame);
  CHECK(robots[1].in_team_frame);
  CHECK(robots[2].in_team_frame);
  CHECK_FALSE(robots[3].in_team_frame);
  CHECK(robots[4].in_team_frame);
  REQUIRE(robots[3].notes.size() == 1);
  CHECK_THAT(robots[3].notes[0], Catch::StartsWith("never joined the others"));
  CHECK(robots[1].notes.empty());

  auto halves = ended({{0, {0, 1}}, {0, {0, 1}}, {2, {2, 3}}, {2, {2, 3}}});
  find_team_frame(halves);
  CHECK(halves[0].in_team_frame);
  CHECK_FALSE(halves[2].in_team_frame);
  CHECK_THAT(halves[3].notes.at(0), Catch::StartsWith("ended in the frame of robot 2"));
}

TEST_CASE("A robot that never joined is not judged in the team's frame", "[team]") {
  const TemporaryFolder folder;
  TeamPlan plan;
  plan.output = folder.path();
  for (const RobotId id : {RobotId{1}, RobotId{2}, RobotId{3}}) {
    RobotPlan robot;
    robot.id = id;
    robot.name = "r" + std::to_string(id);
    robot.graph = "g.csv";
    robot.truth = folder.write(robot.name + ".tum", straight_line(0.0));
    plan.robots.push_back(robot);
    for (const char* file : {"odometry", "optimized"})
      folder.write(robot.name + '/' + file + ".tum", straight_line(id == 3 ? 50.0 : 0.0));
    folder.write(robot.name + "/summary.json",
                 id == 3 ? R"({"pgo": {"anchor": 0, "members": []}})"
                         : R"({"pgo": {"anchor": 1, "members": [1, 2]}})");
  }
  const TeamResult team = collect_results(plan, {{{0, 0}, {}}, {{0, 0}, {}}, {{0, 0}, {}}});
  REQUIRE(team.optimized);
  CHECK(team.optimized->robots.size() == 2);
  CHECK(team.optimized->joint.position_m.rmse < 1e-9);  // with r3 it would be tens of metres
  CHECK(team.robots[2].odometry);
  CHECK_THAT(to_table(team), Catch::Contains("note: r3: never joined the others"));
}

TEST_CASE("A robot that skipped many frames is told of", "[team]") {
  const TemporaryFolder folder;
  TeamResult team = example(folder);
  CHECK_THAT(to_table(team), !Catch::Contains("of its frames"));
  team.robots[0].summary->frames = 20;
  team.robots[0].summary->frames_skipped = 80;
  CHECK_THAT(to_table(team), Catch::Contains("note: " + team.robots[0].plan.name +
                                             " skipped 80 % of its frames: use a lower --rate"));
}

TEST_CASE("The JSON of a run holds every robot", "[team]") {
  const TemporaryFolder folder;
  std::ostringstream text;
  JsonWriter json(text);
  write_json(json, example(folder));
  for (const char* expected : {"\"exit_code\": 3", "\"rounds\": 33", "\"pgo\": 400",
                               "\"optimized\": {", "\"members\": [\n"}) {
    CAPTURE(text.str(), expected);
    CHECK_THAT(text.str(), Catch::Contains(expected));
  }
}

TEST_CASE("Closures are judged in the robots' common world", "[team]") {
  const TemporaryFolder folder;
  const EurocFolder recording;  // for its camera
  TeamPlan plan;
  plan.output = folder.path();
  const std::string keyframes = "robot,keyframe,stamp_ns,median_depth_m\n";
  const std::string closures =
      "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,"
      "tx,ty,tz,qx,qy,qz,qw,reason\n";
  for (const RobotId id : {RobotId{1}, RobotId{2}}) {
    RobotPlan robot;
    robot.id = id;
    robot.name = "r" + std::to_string(id);
    robot.dataset = recording.root();
    robot.truth = folder.write(robot.name + ".tum", straight_line(id == 1 ? 0.0 : 0.1));
    plan.robots.push_back(robot);
    folder.write(robot.name + "/keyframes.csv",
                 keyframes + std::to_string(id) + ",0,5000000000,20\n");
  }
  folder.write("r1/loop_closures.csv",
               closures + "1,0,2,0,0.5,inlier,80,60,0,0,0.1,0,0,0,1,\"\"\n");
  folder.write("r2/loop_closures.csv",
               closures + "2,0,1,0,0.5,verified,80,60,0,3,0,0,0,0,1,\"\"\n");
  const TeamResult team = collect_results(plan, {{{0, 0}, {}}, {{0, 0}, {}}});
  REQUIRE(team.closures);
  CHECK(team.closures->true_pairs == 1);
  CHECK(team.closures->candidates.correct == 2);
  CHECK(team.closures->verified.judged == 2);
  CHECK(team.closures->verified.correct == 1);
  CHECK(team.closures->inliers.precision() == 1.0);
  CHECK(team.notes.empty());
  CHECK_THAT(to_table(team), Catch::Contains("1 pairs of keyframes of two robots"));
  std::ostringstream text;
  JsonWriter json(text);
  write_json(json, team);
  CHECK_THAT(text.str(), Catch::Contains("\"pair_recall\": 1"));

  std::filesystem::remove(folder.path() / "r2/loop_closures.csv");
  const TeamResult part = collect_results(plan, {{{0, 0}, {}}, {{0, 0}, {}}});
  REQUIRE(part.closures);
  CHECK(part.closures->unjudged == 1);
  REQUIRE(part.notes.size() == 1);
  CHECK_THAT(part.notes[0], Catch::StartsWith("r2: closures are not judged: "));
}

TEST_CASE("The tables fit into 120 columns", "[team]") {
  const TemporaryFolder folder;
  std::istringstream lines(to_table(example(folder)));
  for (std::string line; std::getline(lines, line);) {
    CAPTURE(line);
    CHECK((line.size() <= 120 || line.starts_with("note: ")));
  }
}

TEST_CASE("Columns are aligned", "[team]") {
  CHECK(align_columns({{"a", "bb"}, {"ccc", "d"}}) == "a    bb\nccc   d\n");
  CHECK(bytes_text(999) == "999 B");
  CHECK(bytes_text(1500) == "1.5 kB");
  CHECK(fixed(1.0 / 0.0, 2) == "-");
}

}  // namespace km
