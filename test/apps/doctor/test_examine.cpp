#include <catch2/catch.hpp>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/doctor/examine.hpp"
#include "apps/robot/run_findings.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

constexpr const char* kImage = "sensor_msgs/msg/Image";
constexpr const char* kImu = "sensor_msgs/msg/Imu";

Finding the_finding(const Examination& result) {
  REQUIRE(result.findings.size() == 1);
  return result.findings[0];
}

}  // namespace

TEST_CASE("Live topics that are received are sound", "[doctor]") {
  const std::vector<TopicPublisher> publishers = {{"/left", kImage}, {"/imu", kImu}};
  const auto result =
      examine_topics({{"/left", kImage, 60}, {"/imu", kImu, 600}}, publishers, 3.0, 0);
  CHECK(result.findings.empty());
  CHECK_THAT(to_text(result.figures),
             Catch::Contains("60 messages of sensor_msgs/msg/Image in 3.0"));
}

TEST_CASE("The reason why a live topic is silent follows from the publishers", "[doctor]") {
  using Catch::Contains;
  const std::vector<ListenedTopic> wanted = {{"/left", kImage, 0}};
  const auto why = [&](const std::vector<TopicPublisher>& publishers) {
    return the_finding(examine_topics(wanted, publishers, 3.0, 0));
  };
  CHECK(why({{"/imu", kImu}}).id == "live.silent");
  CHECK_THAT(why({{"/imu", kImu}}).what, Contains("no program publishes it"));
  CHECK_THAT(why({{"/left", kImage}}).what, Contains("although a program publishes it"));
  CHECK(why({{"/left", "sensor_msgs/msg/CompressedImage"}}).id == "live.other_type");
  CHECK(why({{"/cam/left", "sensor_msgs/Image"}}).id == "live.similar_name");
  const auto begins_most_alike = why({{"/cam/left", kImage}, {"/left/image", kImage}});
  CHECK_THAT(begins_most_alike.what, Contains("but /left/image is of that type"));
  CHECK_THAT(why({{"/cam/left", kImage}}).what, Contains("/cam/left is of that type"));
  // A topic that another camera already uses is not proposed.
  const auto result = examine_topics({{"/cam0", kImage, 60}, {"/cam2", kImage, 0}},
                                     {{"/cam0", kImage}, {"/other1", kImage}}, 3.0, 0);
  CHECK_THAT(the_finding(result).what, Contains("but /other1 is of that type"));
}

TEST_CASE("If there is no publisher at all, one finding reports it, whatever topics are missing",
          "[doctor]") {
  const auto result = examine_topics({{"/left", kImage, 0}, {"/imu", kImu, 0}}, {}, 3.0, 7);
  REQUIRE(result.findings.size() == 1);
  CHECK(result.figures.size() == 2);
  CHECK(result.findings[0].id == "live.no_publishers");
  CHECK_THAT(result.findings[0].what, Catch::Contains("domain 7"));
}

namespace {

constexpr const char* kHeader =
    "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,inliers,tx,ty,tz,qx,qy,"
    "qz,qw,reason\n";

// Results of alice (0) and bob (1), who are not in one frame.
class Results {
 public:
  Results() {
    for (const RobotId robot : {RobotId{0}, RobotId{1}}) {
      RunSummary summary;
      summary.robot = robot;
      summary.name = robot == 0 ? "alice" : "bob";
      summary.frames = 500;
      summary.pgo.members = {robot};
      summary.exit_reason = "settled";
      write(robot, summary);
      folder.write(summary.name + "/config.yaml", "pcm:\n  selection: pcm\n  min_inliers: 4\n");
      folder.write(summary.name + "/loop_closures.csv", kHeader);
    }
  }
  void write(RobotId robot, const RunSummary& summary) const {
    folder.write(std::string(robot == 0 ? "alice" : "bob") + "/summary.json", json_text(summary));
  }

  TemporaryFolder folder;
};

const char* const kMeasured = "verified,60,39,1,2,3,0,0,0,1,";

}  // namespace

TEST_CASE("The doctor gives the reason why robots did not join, from all files", "[doctor]") {
  const Results results;
  results.folder.write(
      "alice/loop_closures.csv",
      std::string(kHeader) +
          "0,1,1,2,0.5,received,40,0,,,,,,,,\"matches do not agree, on a pose\"\n" +
          "0,3,1,4,0.5," + kMeasured + "\"rejected: the other closures contradict it\"\n" +
          "0,5,1,6,0.5,inlier,60,39,1,2,3,0,0,0,1,\"\"\n");
  results.folder.write(
      "bob/loop_closures.csv",
      std::string(kHeader) + "0,7,1,8,0.5,candidate,0,0,,,,,,,,\"not requested\"\n");
  CHECK(are_results(results.folder.path()));
  const Examination result = examine_results(results.folder.path());
  CHECK_THAT(to_text(result.findings),
             Catch::Contains("alice and bob did not join: 4 candidates, 2 verified (see "
                             "loop_closures.csv), 1 kept: below pcm.min_inliers 4"));
  CHECK(has(result, "closures.rejected"));
  CHECK(exit_code_of(result.findings) == 1);
}

TEST_CASE("The findings on a single robot are those of its end", "[doctor]") {
  const Results results;
  RunSummary summary = read_summary(results.folder.path() / "alice/summary.json");
  summary.findings = {failed_run("vio: no memory"), {.id = "team.not_joined", .what = "x"}};
  results.write(0, summary);
  const Examination result = examine_results(results.folder.path() / "alice");
  CHECK(result.findings.size() == 2);
  CHECK(result.findings[0].id == "run.failed");
  CHECK(exit_code_of(result.findings) == 2);
}

TEST_CASE("The folder of a robot that was killed is no recording, and the message names --resume",
          "[doctor]") {
  const Results results;
  const auto bob = results.folder.path() / "bob";
  std::filesystem::remove(bob / "summary.json");
  results.folder.write("bob/run.journal", "");
  for (const auto& folder : {bob, results.folder.path()}) {
    CAPTURE(folder);
    REQUIRE(are_results(folder));
    const Examination result = examine_results(folder);
    const auto found = std::ranges::find(result.findings, "run.unfinished", &Finding::id);
    REQUIRE(found != result.findings.end());
    CHECK_THAT(found->to_do, Catch::Contains("--resume " + bob.string()));
    CHECK(exit_code_of(result.findings) == 1);
  }
}

TEST_CASE("Results with files that are missing or broken are examined as far as possible",
          "[doctor]") {
  const Results results;
  std::filesystem::remove(results.folder.path() / "alice/config.yaml");
  results.folder.write("bob/loop_closures.csv", std::string(kHeader) + "0,1\n");
  const Examination result = examine_results(results.folder.path());
  CHECK(has(result, "results.config"));
  CHECK(has(result, "results.loop_closures"));
  CHECK(has(result, "team.not_joined"));
  results.folder.write("bob/summary.json", "{");
  CHECK_THROWS_WITH(examine_results(results.folder.path()), Catch::Contains("bob/summary.json"));
  CHECK_FALSE(are_results(results.folder.path() / "nowhere"));
}

}  // namespace km
