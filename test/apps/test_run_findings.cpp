#include "apps/robot/run_findings.hpp"
#include "modules/diagnosis/doubt_finding.hpp"
#include "test/support/test.hpp"

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

TEST_CASE("Runs of robots that joined have no findings") {
  const std::vector<RunFacts> team = {run_of(0, true, tally_of(400, 30, 10, 10)),
                                      run_of(2, true, tally_of(300, 20, 5, 5))};
  CHECK(findings_of(team).empty());
}

TEST_CASE("Why two robots did not join is one sentence with the counts of both") {
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

TEST_CASE(
    "If robots share enough closures, a lost link is named as the reason why they are apart") {
  RunFacts run = run_of(0, false, tally_of(400, 100, 30, 20));
  const auto what = [&run] {
    const auto findings = findings_of_one(run);
    const auto found = std::ranges::find(findings, "team.not_joined", &Finding::id);
    REQUIRE(found != findings.end());
    return found->what;
  };
  CHECK_THAT(what(), StartsWith("alice and bob did not join: "));
  run.summary.lost_peers = {{"bob", 12.0}};
  CHECK_THAT(what(), StartsWith("alice and bob are in different frames at the end: ") &&
                         Contains("20 kept, but one robot was not received"));
  run.closures[2] = tally_of(400, 100, 0, 0);  // without candidates, that is the reason
  CHECK_THAT(what(),
             StartsWith("alice and bob did not join: ") && !Contains("one robot was not received"));
}

TEST_CASE("Two robots did not join for the first stage that stopped their closures") {
  const auto why = [](const ClosureTally& tally) {
    const auto findings = findings_of_one(run_of(0, false, tally));
    REQUIRE_FALSE(findings.empty());
    CHECK(findings.front().id == "team.not_joined");
    return findings.front().what;
  };
  CHECK_THAT(why({}), Contains("did not join: 0 candidates: no place of one robot looks like"));
  RunFacts other = run_of(0, false, {});
  other.summary.other_vocabulary["bob"] = 77;
  const auto findings = findings_of_one(other);
  REQUIRE(findings.size() == 2);
  CHECK_THAT(findings[1].what,
             Contains("0 candidates: their keyframes have different vocabularies"));
  CHECK_THAT(why(tally_of(9, 0, 0, 0)), Contains("9 candidates, no keyframe was received"));
  CHECK_THAT(
      why(tally_of(9, 7, 0, 0)),
      Contains("9 candidates, 7 compared, 0 verified (see loop_closures.csv); most common reason: "
               "\"matches do not agree on a pose\" (7 of 7)"));
  CHECK_THAT(why(tally_of(9, 7, 1, 0)),
             Contains("1 verified (see loop_closures.csv), 0 kept: no "
                      "pcm.min_witnesses 2 closures at different places agree"));
  ClosureTally rejected = tally_of(9, 7, 3, 0);
  rejected.rejected = 3;
  CHECK_THAT(why(rejected), Contains("3 rejected by the optimiser, 0 kept"));
  CHECK_THAT(why(tally_of(9, 7, 3, 3)), Contains("3 kept: enough"));
  CHECK_THAT(why(tally_of(9, 7, 5, 2)), Contains("2 kept, which the other closures contradict"));
}

TEST_CASE("An error of the network hides no finding on the cameras") {
  RunFacts run = run_of(0, true, tally_of(400, 30, 10, 10));
  run.summary.cameras = {.offset_s = 0.02, .offset_sigma_s = 0.001};
  REQUIRE(the_finding_of(run).id == "cameras.offset");
  run.summary.noticed = {{.id = "network.path_mtu", .severity = Severity::kError}};
  CHECK(findings_of_one(run).size() == 2);
  run.summary.noticed = {{.id = "imu.time_offset", .severity = Severity::kWarning}};
  CHECK(the_finding_of(run).id == "imu.time_offset");  // explains the estimated offset
}

TEST_CASE("Robots that one place or no closure ties are reported as such") {
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
  CHECK_THAT(findings_of(runs)[0].what, Contains("did not join"));
}

TEST_CASE("A tally counts the stages that a closure came through, and why it stopped") {
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

TEST_CASE("A finding on a run is reported with its severity and its number") {
  using enum Severity;
  struct Row {
    const char* id;  // null: no finding
    Severity severity;
    const char* number;
    std::function<void(RunFacts&)> change;
  };
  const auto of = [](auto change) { return [change](RunFacts& run) { change(run.summary); }; };
  const HolesSummary hole{.count = 1, .seconds = 6.3, .longest_s = 6.3, .longest_from_s = 12.06},
      holes{.count = 3, .seconds = 9.0, .longest_s = 6.3, .longest_from_s = 12.06};
  const Row rows[] = {
      {"frames.none", kError, "0 frames, 0 keyframes", of([](auto& s) { s.frames = 0; })},
      {nullptr, kNote, "a pose graph has no frames",
       of([](auto& s) { s.frames = 0, s.keyframes = 30; })},
      {"frames.skipped", kWarning, "500 frames skipped, 50 %",
       of([](auto& s) { s.frames_skipped = 500; })},
      {"frames.skipped", kNote, "1 frames skipped, 0.2 %",
       of([](auto& s) { s.frames_skipped = 1; })},
      {"frames.paused", kNote, "paused for 3.2 s in all", of([](auto& s) { s.paused_s = 3.25; })},
      {nullptr, kNote, "a short pause", of([](auto& s) { s.paused_s = 0.75; })},
      {"odometry.noisy", kWarning, "1.0 times the stated one in rotation, 6.8 times",
       of([](auto& s) { s.pgo.odometry_translation_noise = 6.75; })},
      {"odometry.noisy", kNote, "2.8 times the stated one in rotation", of([](auto& s) {
         s.pgo.odometry_rotation_noise = 2.8;
         s.correction = {.largest_m = 0.07, .normalised_square = 3.6};
       })},
      {nullptr, kNote, "little noise", of([](auto& s) { s.pgo.odometry_translation_noise = 1.5; })},
      {"odometry.broken", kWarning, "2 steps of odometry are wrong",
       of([](auto& s) { s.pgo.odometry_breaks = 2; })},
      {"odometry.contradicted", kWarning, "up to 0.92 m from odometry, 3.0 times",
       of([](auto& s) { s.correction = {.largest_m = 0.92, .normalised_square = 9.0}; })},
      {nullptr, kNote, "a usual correction",
       of([](auto& s) { s.correction = {.largest_m = 0.92, .normalised_square = 2.0}; })},
      {"odometry.images_alone", kNote, "without an inertial sensor",
       of([](auto& s) { s.odometry = VioStatistics{.has_imu = false}; })},
      {"odometry.blind", kWarning, "vision was lost 3 times, for 1.5 s in all",
       of([](auto& s) { s.odometry = VioStatistics{.vision_losses = 3, .blind_s = 1.5}; })},
      {"map.dropped_under_load", kWarning, "25 frames were left out of the map, 25 %",
       of([](auto& s) { s.mapping = {.frames = 75, .dropped_under_load = 25}; })},
      {"map.dropped_under_load", kNote, "1 frames",
       of([](auto& s) { s.mapping = {.frames = 75, .dropped_under_load = 1}; })},
      {"sensors.faults", kWarning,
       "116 images missing between others, 1 pauses of a camera; 500 complete frames",
       of([](auto& s) {
         s.sensor_faults = {{"images missing between others", 116}, {"pauses of a camera", 1}};
       })},
      {nullptr, kNote, "rare faults", of([](auto& s) {
         s.sensor_faults = {{"images missing between others", 5}};
       })},
      {"stereo.baseline", kError, ": a baseline of 110 m", of([](auto& s) {
         s.noticed = {finding_of(*doubt(UsualNumber::kBaseline_m, 110.0))};
         s.cameras = {.rotation_y_rad = 0.08, .rotation_sigma_rad = 0.005};
       })},
      {"trajectory.hole", kWarning, "no pose for 6.3 s, from 12.1 s on",
       of([=](auto& s) { s.holes = hole; })},
      {"trajectory.hole", kWarning, "the longest of 3 holes of 9.0 s in all",
       of([=](auto& s) { s.holes = holes; })},
      {"frames.clock", kWarning, "jump by 1403636484.9 s, 12.1 s after the first pose",
       of([=](auto& s) { (s.holes = hole)->longest_s = 1403636484.9; })},
      {"closures.rejected", kNote, "2 of 10 verified",
       [](RunFacts& run) { run.closures[2].rejected = 2; }},
      {"closures.rejected", kWarning, "5 of 10 verified",
       [](RunFacts& run) { run.closures[2].rejected = 5; }},
      {"cameras.offset", kWarning, "20.0 ms (+- 1.0)",
       of([](auto& s) { s.cameras = {.offset_s = 0.02, .offset_sigma_s = 0.001}; })},
      {"cameras.offset", kNote, "-4.0 ms",
       of([](auto& s) { s.cameras = {.offset_s = -0.004, .offset_sigma_s = 0.001}; })},
      {nullptr, kNote, "an uncertain offset",
       of([](auto& s) { s.cameras = {.offset_s = -0.004, .offset_sigma_s = 0.002}; })},
      {"cameras.rolling", kNote, "15.1 ms (+- 1.0)",
       of([](auto& s) { s.cameras = {.readout_s = 0.0151, .readout_sigma_s = 0.001}; })},
      {nullptr, kNote, "an uncertain readout time",
       of([](auto& s) { s.cameras = {.readout_s = 0.0151, .readout_sigma_s = 0.006}; })},
      {"cameras.turned", kWarning, "2.00 degrees",
       of([](auto& s) { s.cameras = {.rotation_y_rad = 0.0349, .rotation_sigma_rad = 0.001}; })},
      {"link.lost", kWarning, "bob was not received in the last 31.2 s",
       of([](auto& s) { s.lost_peers["bob"] = 31.25; })},
      {"network.forged", kWarning, "announcements of 2 robots were forged",
       of([](auto& s) { s.forged_announcements = 2; })},
      {"network.unmet", kWarning, "bob was never met: it is mute",
       of([](auto& s) { s.unmet_peers["bob"] = "it is mute"; })},
      {"vocabulary.other", kError, "77 keyframes of bob",
       of([](auto& s) { s.other_vocabulary["bob"] = 77; })},
      {"network.other", kWarning, "5 keyframes of bob were matched by ORB",
       of([](auto& s) { s.other_network["bob"] = 5; })},
      {"budget.held_back", kNote, "delayed 12 messages",
       of([](auto& s) { s.held_back.emplace().delayed.messages["pgo"] = 12; })},
      {"budget.held_back", kWarning, "dropped 3",
       of([](auto& s) { s.held_back.emplace().dropped.messages["mesh"] = 3; })},
      {"memory.grows", kWarning, "30.0 MB a minute",
       of([](auto& s) { s.process.memory_growth_bytes_per_minute = 30e6; })},
      {"map.full", kWarning, "5 blocks", of([](auto& s) { s.mapping = {.blocks_refused = 5}; })},
      {"map.frames_late", kWarning, "7 frames were too late",
       of([](auto& s) { s.mapping = {.frames = 6, .skipped_too_late = 7}; })},
  };
  for (const Row& row : rows) {
    CAPTURE(row.number);
    RunFacts run = run_of(0, true, tally_of(40, 30, 10, 10));
    row.change(run);
    const std::vector<Finding> findings = findings_of_one(run);
    REQUIRE(findings.size() == (row.id == nullptr ? 0 : 1));
    if (row.id == nullptr) continue;
    CHECK(findings[0].id == row.id);
    CHECK(findings[0].severity == row.severity);
    CHECK_THAT(findings[0].what, Contains(row.number));
  }
}

TEST_CASE("Findings on the network precede others of their severity") {
  std::vector<RunFacts> team = {run_of(0, false, {}), run_of(2, false, {})};
  team[0].summary.frames_skipped = 500;
  team[0].summary.sensor_faults = {{"missing images", 8}};  // 0.8 % of 1000 frames
  team[1].summary.unmet_peers["alice"] = "it is mute";
  std::string ids;
  for (const Finding& finding : findings_of(team)) ids += finding.id + ' ';
  CHECK(ids == "network.unmet team.not_joined frames.skipped ");
}

TEST_CASE("The advice on pauses and holes depends on skipped frames") {
  RunFacts run = run_of(0, true, tally_of(40, 30, 10, 10));
  run.summary.paused_s = 3.0;
  CHECK_THAT(the_finding_of(run).means, Contains("every image was used"));
  run.summary.paused_s = 0.0;
  run.summary.holes = HolesSummary{.count = 1, .longest_s = 6.3};
  CHECK_THAT(the_finding_of(run).to_do, Contains("sensor_faults"));
  run.summary.frames_skipped = 1;
  CHECK_THAT(findings_of_one(run).at(0).to_do, Contains("--rate auto"));
}

}  // namespace km
