#include <catch2/catch.hpp>

#include "apps/robot/run_findings.hpp"

namespace km {
namespace {

ClosureTally tally_of(std::uint64_t candidates, std::uint64_t received, std::uint64_t verified,
                      std::uint64_t inliers) {
  ClosureTally tally{.candidates = candidates,
                     .received = received,
                     .verified = verified,
                     .inliers = inliers,
                     .rejected = 0,
                     .unmatched = {}};
  if (received > verified) tally.unmatched["matches do not agree on a pose"] = received - verified;
  return tally;
}

// A sound run of `robot`, whose team is robots 0 and 2; in one frame if `joined`.
RunFacts run_of(RobotId robot, bool joined, const ClosureTally& with_other) {
  RunFacts run;
  run.summary.robot = robot;
  run.summary.name = robot == 0 ? "alice" : "bob";
  run.summary.frames = 500;
  run.summary.pgo.members = joined ? std::vector<RobotId>{0, 2} : std::vector<RobotId>{robot};
  run.closures[static_cast<RobotId>(2 - robot)] = with_other;
  run.names = {{robot == 0 ? RobotId{2} : RobotId{0}, robot == 0 ? "bob" : "alice"}};
  return run;
}

std::vector<Finding> findings_of_one(const RunFacts& run) {
  return findings_of(std::span(&run, 1));
}

// The only finding of a run.
Finding the_finding_of(const RunFacts& run) {
  const std::vector<Finding> findings = findings_of_one(run);
  REQUIRE(findings.size() == 1);
  return findings.front();
}

}  // namespace

TEST_CASE("Runs of robots that joined have no findings", "[robot][findings]") {
  const std::vector<RunFacts> team = {run_of(0, true, tally_of(400, 30, 10, 10)),
                                      run_of(2, true, tally_of(300, 20, 5, 5))};
  CHECK(findings_of(team).empty());
}

TEST_CASE("Why two robots did not join is one sentence with the counts of both",
          "[robot][findings]") {
  using Catch::Equals;
  std::vector<RunFacts> team = {run_of(0, false, tally_of(400, 100, 30, 2)),
                                run_of(2, false, tally_of(12, 5, 1, 0))};
  for (RunFacts& run : team) run.pcm.selection = ClosureSelection::kPcm;
  const auto findings = findings_of(team);
  REQUIRE(findings.size() == 1);
  CHECK(findings[0].id == "team.not_joined");
  CHECK(findings[0].severity == Severity::kWarning);
  CHECK_THAT(findings[0].what,
             Equals("alice and bob did not join: 412 candidates, 31 verified (see "
                    "loop_closures.csv), 2 kept: below pcm.min_inliers 3"));
}

TEST_CASE("If robots share enough closures, a lost link is named as the reason why they are apart",
          "[robot][findings]") {
  RunFacts run = run_of(0, false, tally_of(400, 100, 30, 20));
  const auto what = [&run] {
    const auto findings = findings_of_one(run);
    const auto found = std::ranges::find(findings, "team.not_joined", &Finding::id);
    REQUIRE(found != findings.end());
    return found->what;
  };
  CHECK_THAT(what(), Catch::StartsWith("alice and bob did not join: "));
  run.summary.lost_peers = {{"bob", 12.0}};
  CHECK_THAT(what(), Catch::StartsWith("alice and bob are not in one frame in the end: ") &&
                         Catch::Contains("20 kept, but one was not received any more"));
  run.closures[2] = tally_of(400, 100, 0, 0);  // without candidates, that is the reason
  CHECK_THAT(what(), Catch::StartsWith("alice and bob did not join: ") &&
                         !Catch::Contains("not received any more"));
}

TEST_CASE("Two robots did not join for the first stage that stopped their closures",
          "[robot][findings]") {
  const auto why = [](const ClosureTally& tally) {
    const auto findings = findings_of_one(run_of(0, false, tally));
    REQUIRE_FALSE(findings.empty());
    CHECK(findings.front().id == "team.not_joined");
    return findings.front().what;
  };
  using Catch::Contains;
  CHECK_THAT(why({}), Contains("did not join: 0 candidates: no place of one looks like"));
  RunFacts other = run_of(0, false, {});
  other.summary.other_vocabulary["bob"] = 77;
  const auto findings = findings_of_one(other);
  REQUIRE(findings.size() == 2);
  CHECK_THAT(findings[1].what, Contains("0 candidates: their keyframes are described by diff"));
  CHECK_THAT(why(tally_of(9, 0, 0, 0)), Contains("9 candidates, of which no keyframe came"));
  CHECK_THAT(why(tally_of(9, 7, 0, 0)),
             Contains("9 candidates, 7 compared, 0 verified (see loop_closures.csv), most of them: "
                      "\"matches do not agree on a pose\" (7 of 7)"));
  CHECK_THAT(why(tally_of(9, 7, 1, 0)), Contains("1 verified (see loop_closures.csv), 0 kept: no "
                                                 "pcm.min_witnesses 2 that agree"));
  ClosureTally rejected = tally_of(9, 7, 3, 0);
  rejected.rejected = 3;
  CHECK_THAT(why(rejected), Contains("3 rejected by the optimiser, 0 kept"));
  CHECK_THAT(why(tally_of(9, 7, 3, 3)), Contains("3 kept: enough"));
  CHECK_THAT(why(tally_of(9, 7, 5, 2)), Contains("2 kept, which the others contradict"));
}

TEST_CASE("Robots that one place or no closure ties are reported as such", "[robot][findings]") {
  std::vector<RunFacts> runs{run_of(0, true, tally_of(9, 7, 3, 3)), run_of(2, true, {})};
  CHECK(findings_of(runs).empty());
  runs[0].summary.pgo.tentative = {2};
  runs[1].summary.pgo.tentative = {0};
  const auto tentative = findings_of(runs);
  REQUIRE(tentative.size() == 1);  // once for both robots
  CHECK(tentative[0].id == "team.tentative");
  CHECK(tentative[0].severity == Severity::kWarning);
  runs[0].summary.pgo.tentative.clear();
  runs[1].summary.pgo.tentative.clear();
  runs[0].summary.pgo.not_joined = {2};
  CHECK(findings_of(runs).size() == 1);
  CHECK_THAT(findings_of(runs)[0].what, Catch::Contains("did not join"));
}

TEST_CASE("A tally counts the stages that a closure came through, and why it stopped",
          "[robot][findings]") {
  ClosureTally tally;
  tally.add(ClosureStage::kCandidate, "not requested");
  tally.add(ClosureStage::kReceived, "too few inliers");
  tally.add(ClosureStage::kVerified, kRejectedByOptimiser);
  tally.add(ClosureStage::kVerified, "inconsistent with the other closures of the robot pair");
  tally.add(ClosureStage::kInlier, "");
  CHECK(tally.candidates == 5);
  CHECK(tally.received == 4);
  CHECK(tally.verified == 3);
  CHECK(tally.inliers == 1);
  CHECK(tally.rejected == 1);
  CHECK(tally.unmatched == std::map<std::string, std::uint64_t>{{"too few inliers", 1}});
}

TEST_CASE("A finding on a run is reported with its number", "[robot][findings]") {
  RunFacts run = run_of(0, true, tally_of(40, 30, 10, 10));
  RunSummary& summary = run.summary;
  const auto check_finding = [&](const char* id, Severity severity, const char* number) {
    const Finding finding = the_finding_of(run);
    CHECK(finding.id == id);
    CHECK(finding.severity == severity);
    CHECK_THAT(finding.what, Catch::Contains(number));
  };
  SECTION("no frame at all") {
    summary.frames = 0;
    check_finding("frames.none", Severity::kError, "0 frames, 0 keyframes");
    summary.keyframes = 30;  // a pose graph that is played has no frames
    CHECK(findings_of_one(run).empty());
  }
  SECTION("frames skipped") {
    summary.frames_skipped = 500;
    check_finding("frames.skipped", Severity::kWarning, "500 frames skipped, 50 %");
    summary.frames_skipped = 1;
    check_finding("frames.skipped", Severity::kNote, "1 frames skipped, 0.2 %");
  }
  SECTION("odometry that is noisier than it claims") {
    summary.pgo.odometry_translation_noise = 6.75;
    check_finding("odometry.noisy", Severity::kWarning,
                  "1.0 times noisier in rotation and 6.8 times");
    summary.pgo.odometry_translation_noise = 1.5;
    CHECK(findings_of_one(run).empty());
  }
  SECTION("steps of odometry that are wrong") {
    summary.pgo.odometry_breaks = 2;
    check_finding("odometry.broken", Severity::kWarning, "2 steps of its odometry are wrong");
  }
  SECTION("a recording that was paused") {
    summary.paused_s = 0.75;
    CHECK(findings_of_one(run).empty());
    summary.paused_s = 3.25;
    check_finding("frames.paused", Severity::kNote, "paused for 3.2 s in all");
    CHECK_THAT(the_finding_of(run).means, Catch::Contains("every image was used"));
  }
  SECTION("a map that skipped frames") {
    summary.mapping = MappingSummary{.frames = 75, .dropped_under_load = 25};
    check_finding("map.dropped_under_load", Severity::kWarning,
                  "25 frames were left out of the map, 25 %");
    summary.mapping->dropped_under_load = 1;
    check_finding("map.dropped_under_load", Severity::kNote, "1 frames");
  }
  SECTION("images that are missing") {
    summary.sensor_faults = {{"images missing between others", 116}, {"pauses of a camera", 1}};
    check_finding("sensors.faults", Severity::kWarning,
                  "116 images missing between others, 1 pauses of a camera; 500 frames were whole");
    summary.sensor_faults = {{"images missing between others", 5}};
    CHECK(findings_of_one(run).empty());
  }
  SECTION("a hole of the trajectory") {
    summary.holes =
        HolesSummary{.count = 1, .seconds = 6.3, .longest_s = 6.3, .longest_from_s = 12.06};
    check_finding("trajectory.hole", Severity::kWarning, "no pose for 6.3 s, from 12.1 s on");
    CHECK_THAT(the_finding_of(run).to_do, Catch::Contains("sensor_faults"));
    summary.holes->count = 3;
    summary.holes->seconds = 9.0;
    check_finding("trajectory.hole", Severity::kWarning, "the longest of 3 holes of 9.0 s in all");
    summary.frames_skipped = 1;
    const auto findings = findings_of_one(run);
    REQUIRE(findings.size() == 2);
    CHECK_THAT(findings[0].to_do, Catch::Contains("--rate auto"));
  }
  SECTION("closures rejected") {
    run.closures[2].rejected = 2;
    check_finding("closures.rejected", Severity::kNote, "2 of 10 verified");
    run.closures[2].rejected = 5;
    check_finding("closures.rejected", Severity::kWarning, "5 of 10 verified");
  }
  SECTION("offset of the cameras") {
    summary.cameras = CamerasSummary{.offset_s = 0.02, .offset_sigma_s = 0.001};
    check_finding("cameras.offset", Severity::kWarning, "20.0 ms (+- 1.0)");
    summary.cameras->offset_s = -0.004;
    check_finding("cameras.offset", Severity::kNote, "-4.0 ms");
    summary.cameras->offset_sigma_s = 0.002;  // it may be none
    CHECK(findings_of_one(run).empty());
  }
  SECTION("rolling shutter") {
    summary.cameras = CamerasSummary{.readout_s = 0.0151, .readout_sigma_s = 0.001};
    check_finding("cameras.rolling", Severity::kNote, "15.1 ms (+- 1.0)");
    summary.cameras->readout_sigma_s = 0.006;  // it may be none
    CHECK(findings_of_one(run).empty());
  }
  SECTION("cameras turned") {
    summary.cameras = CamerasSummary{.rotation_y_rad = 0.0349, .rotation_sigma_rad = 0.001};
    check_finding("cameras.turned", Severity::kWarning, "2.00 degrees");
  }
  SECTION("a link lost") {
    summary.lost_peers["bob"] = 31.25;
    check_finding("link.lost", Severity::kWarning, "bob had not been received for 31.2 s");
  }
  SECTION("another vocabulary") {
    summary.other_vocabulary["bob"] = 77;
    check_finding("vocabulary.other", Severity::kError, "77 keyframes of bob");
  }
  SECTION("another network") {
    summary.other_network["bob"] = 5;
    check_finding("network.other", Severity::kWarning, "5 keyframes of bob were matched by ORB");
  }
  SECTION("held back") {
    summary.held_back.emplace().delayed.messages["pgo"] = 12;
    check_finding("budget.held_back", Severity::kNote, "delayed 12 messages");
    summary.held_back->dropped.messages["mesh"] = 3;
    check_finding("budget.held_back", Severity::kWarning, "dropped 3");
  }
  SECTION("memory") {
    summary.process.memory_growth_bytes_per_minute = 30e6;
    check_finding("memory.grows", Severity::kWarning, "30.0 MB a minute");
  }
  SECTION("the map") {
    summary.mapping.emplace().blocks_refused = 5;
    check_finding("map.full", Severity::kWarning, "5 blocks");
  }
}

}  // namespace km
