#include <catch2/catch.hpp>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/doctor/examine_results.hpp"
#include "apps/robot/run_findings.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
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
