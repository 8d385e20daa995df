#include "apps/robot/robot_config.hpp"
#include "apps/robot/run_end.hpp"
#include "apps/robot/unmet_peers.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kSettle_s = 2.0;
constexpr double kLimit_s = 60.0;
constexpr Departure::Present kSettled{RobotPhase::kSettled, 1};

// A robot whose input has ended and whose graph has settled.
struct Done {
  Departure departure{kSettle_s, kLimit_s};
  std::vector<Departure::Present> peers;
  Departure::Inputs inputs{.input_ended = true, .graph_settled = true};

  RobotPhase phase_at(double now_s) {
    inputs.present_peers = peers;
    return departure.update(now_s, inputs).phase;
  }
  bool leaves_at(double now_s) {
    phase_at(now_s);
    return departure.reason() != nullptr;
  }
};

TEST_CASE("A robot alone leaves once its graph has been quiet") {
  Done robot;
  CHECK(robot.departure.update(0.0, {.activity = 1}).phase == RobotPhase::kRunning);
  robot.inputs.activity = 2;
  CHECK(robot.phase_at(10.0) == RobotPhase::kFinished);
  CHECK(robot.phase_at(11.0) == RobotPhase::kSettled);
  CHECK(robot.departure.reason() == nullptr);
  CHECK(robot.leaves_at(13.0));
}

TEST_CASE("A robot serves a peer that is still running, up to the limit") {
  Done robot{.peers = {kSettled, {}}};
  for (double now_s = 5.0; now_s < 5.0 + kLimit_s; now_s += 1.0)
    CHECK_FALSE(robot.leaves_at(now_s));
  CHECK(robot.leaves_at(5.0 + kLimit_s));
}

TEST_CASE("A robot serves its peers until the last session has come") {
  CHECK(RobotOptions{}.serve_limit_s > PoseGraphConfig{}.session_wait_s);
}

TEST_CASE("A robot awaits the robots of its closures, up to the limit") {
  Done robot;
  robot.inputs.awaits_peers = true;
  CHECK(robot.phase_at(50.0) == RobotPhase::kFinished);
  CHECK_FALSE(robot.leaves_at(50.0 + kLimit_s - 0.1));
  CHECK(robot.leaves_at(50.0 + kLimit_s));
}

TEST_CASE("New work after all had settled starts the wait again") {
  Done robot{.peers = {kSettled}};
  robot.phase_at(4.0);
  robot.inputs.activity = 1;  // a closure arrived
  CHECK(robot.phase_at(5.5) == RobotPhase::kFinished);
  CHECK(robot.phase_at(6.5) == RobotPhase::kSettled);
  CHECK(robot.departure.reason() == nullptr);
  CHECK(robot.leaves_at(8.5));
}

TEST_CASE("A settled robot leaves as soon as a peer reports that it leaves") {
  Done robot{.peers = {kSettled, kSettled}};
  CHECK_FALSE(robot.leaves_at(9.0));
  robot.peers[1].phase = RobotPhase::kLeaving;
  robot.inputs.graph_settled = false;  // not while there is work
  CHECK_FALSE(robot.leaves_at(9.1));
  robot.inputs.graph_settled = true;
  CHECK(robot.leaves_at(9.2));
}

TEST_CASE("A robot whose graph never settles leaves at the limit") {
  Done robot;
  robot.inputs.graph_settled = false;
  CHECK(robot.phase_at(0.0) == RobotPhase::kFinished);
  CHECK(robot.departure.reason() == nullptr);
  CHECK(robot.phase_at(kLimit_s) == RobotPhase::kFinished);
  CHECK(robot.departure.reason() != nullptr);
}

// Leaving times [s] of a chain of robots that all poll ten times a second and receive their
// neighbours a poll later. Robot `restless` settles at `from_s` only.
std::vector<double> departures(std::size_t count, std::size_t restless, double from_s) {
  std::vector<Departure> robots(count, Departure(kSettle_s, kLimit_s));
  std::vector<Departure::Present> reported(count);
  std::vector<double> left_s(count, 0.0);
  for (int poll = 0; poll < 600; ++poll) {
    const double now_s = 0.1 * poll;
    const auto before = reported;
    for (std::size_t k = 0; k < count; ++k) {
      if (left_s[k] > 0.0) continue;
      std::vector<Departure::Present> received;
      for (const std::size_t other : {k - 1, k + 1})
        if (other < count && (left_s[other] == 0.0 || now_s - left_s[other] < 1.0))
          received.push_back(before[other]);
      reported[k] = robots[k].update(now_s, {.input_ended = true,
                                             .graph_settled = k != restless || now_s >= from_s,
                                             .activity = 0,
                                             .present_peers = received,
                                             .not_received = count - 1 - received.size()});
      if (robots[k].reason() == nullptr) continue;
      reported[k].phase = RobotPhase::kLeaving;
      left_s[k] = now_s;
    }
  }
  return left_s;
}

TEST_CASE("In a chain every robot waits for the one at the end, and then all go") {
  const std::size_t restless = GENERATE(0U, 3U, 7U);
  CAPTURE(restless);
  for (const double s : departures(8, restless, 20.0)) {
    CHECK(s >= 20.0);
    CHECK(s < 20.0 + 3.0 * kSettle_s);
  }
}

RunEnd usual_end() {
  RunEnd end{.robot = 7, .result = {}, .departure = "all present robots have settled"};
  end.images = ImageCounts{.listed = 100, .read = 90, .skipped = 6, .with_pose = 88};
  return end;
}

TEST_CASE("A run is judged by the gravest that happened to it") {
  CHECK(to_string(*usual_end().images) == "88 of 100 images have a pose");
  const RunResult::Failure failed{"vio", "out of memory"},
      hung{"vio", "has not finished one step for 30 s", true};
  const auto be_silent = [](RunEnd& end) {  // live sensors without an image
    end.is_live = true;
    end.images = ImageCounts{};
  };
  const auto miss_bob = [](RunEnd& end) { end.missed = {{"bob", Absence::kSilent, 31.24}}; };
  const auto miss_both = [&](RunEnd& end) {
    miss_bob(end);
    end.missed.push_back({"carol", Absence::kApart, 7.0});
    end.departure = "time limit for serving peers";
  };
  const auto lose_results = [](RunEnd& end) {
    end.lost_results = {{"out/a", "out/a: cannot be written: No space left on device"},
                        {"out/b", "out/b: cannot be written: Is a directory"}};
  };
  const auto have_no_pose = [](RunEnd& end) { end.images->with_pose = 0; };
  const auto have_fault = [](RunEnd& end) { end.odometry_fault = "a baseline of 110 m"; };
  const auto interrupt = [](RunEnd& end) { end.result.interrupted = true; };
  const auto take_id = [](RunEnd& end) { end.id_taken = true; };
  using Changes = std::vector<std::function<void(RunEnd&)>>;
  const std::vector<std::tuple<Changes, int, std::string>> rows = {
      {{}, 0, "all present robots have settled"},
      {{have_no_pose},
       1,
       "no pose estimated: of 100 images, 4 could not be used, 6 were skipped because processors "
       "were short, 90 were read but odometry did not start on them"},
      {{[](RunEnd& end) { end.images.reset(); }}, 0, "all present robots have settled"},
      {{have_fault}, 1, "odometry is wrong: a baseline of 110 m"},
      {{have_fault, have_no_pose}, 1, "no pose estimated: a baseline of 110 m"},
      {{have_no_pose, interrupt}, 0, "interrupted"},
      {{be_silent, interrupt}, 1, "no image came: kimera_multi_doctor --live"},
      {{be_silent, interrupt, [](RunEnd& end) { end.images->read = 1; }}, 0, "interrupted"},
      {{be_silent, take_id}, 3, "another robot has this robot's id 7"},
      {{miss_bob}, 0, "settled without bob (not received for 31.2 s)"},
      {{miss_both},
       0,
       "time limit for serving peers without bob (not received for 31.2 s), carol (received, but "
       "not in one frame for 7.0 s)"},
      {{[](RunEnd& end) { end.unmet["dora"] = "its announcements are forged"; }},
       0,
       "settled without dora (never met: its announcements are forged)"},
      {{miss_both, interrupt}, 0, "interrupted"},  // before it could leave
      {{[](RunEnd& end) { end.is_alone = true; }}, 0, "settled; no other robot was met"},
      {{lose_results},
       4,
       "all present robots have settled; 2 results lost: out/a: cannot be written: No space left "
       "on device; out/b: cannot be written: Is a directory"},
      {{lose_results, have_no_pose}, 1, "no pose estimated"},
      {{take_id}, 3, "another robot has this robot's id 7"},
      {{take_id, [&](RunEnd& end) { end.result.failure = hung; }}, 5, "vio: has not finished"},
      {{take_id, [&](RunEnd& end) { end.result.failure = failed; }}, 3, "vio: out of memory"},
      {{lose_results, have_no_pose, [&](RunEnd& end) { end.result.failure = failed; }},
       3,
       "vio: out of memory"},
  };
  for (const auto& [changes, exit_code, reason] : rows) {
    RunEnd end = usual_end();
    for (const auto& change : changes) change(end);
    CAPTURE(reason);
    CHECK(verdict_of(end).exit_code == exit_code);
    CHECK_THAT(verdict_of(end).reason, StartsWith(reason));
  }
}

using enum PeerState;

// "bob silent 10 carol apart 7 "
std::string text_of(const Absentees& absentees, double second_hand_s = 0.0) {
  std::string text;
  for (const MissedPeer& peer : absentees.missed(second_hand_s))
    text += peer.name + (peer.why == Absence::kSilent ? " silent " : " apart ") +
            std::to_string(static_cast<int>(peer.missed_s)) + ' ';
  return text;
}

TEST_CASE("A robot is missed for as long as it has been silent or in another frame") {
  const std::vector<RobotId> alone{1}, with_bob{1, 2};
  Absentees absentees;
  CHECK(text_of(absentees).empty());
  absentees.update(99.0, {{2, {"bob", kAlive}}, {7, {"carol", kAlive}}}, with_bob);
  CHECK(text_of(absentees) == "carol apart 0 ");
  absentees.update(100.0, {{2, {"bob", kLost}}, {7, {"carol", kAlive}}}, alone);
  absentees.update(103.0, {{2, {"bob", kLost}}, {7, {"carol", kLost}}}, alone);
  absentees.update(110.0, {{2, {"bob", kLost}}, {7, {"carol", kLost}}}, alone);
  CHECK(text_of(absentees) == "bob silent 10 carol silent 7 ");
  CHECK(absentees.is_present(2, 11.1));
  CHECK_FALSE(absentees.is_present(2, 11.0));
  absentees.update(110.0, {{2, {"bob", kLost}}, {7, {"carol", kLost}}}, with_bob);
  CHECK(text_of(absentees) == "carol silent 7 ");  // others receive bob
  absentees.update(111.0, {{2, {"bob", kAlive}}, {7, {"carol", kLost}}}, alone);
  absentees.update(112.0, {{2, {"bob", kAlive}}, {7, {"carol", kLeft}}}, alone);
  CHECK(text_of(absentees) == "bob apart 1 ");
  CHECK_FALSE(absentees.is_present(7, 60.0));  // it has left
}

TEST_CASE("A member that only others received is missed once it cannot have left in order") {
  Absentees absentees;
  absentees.update(5.0, {{2, {"bob", kAlive}}}, std::vector<RobotId>{1, 2, 7});
  absentees.update(6.0, {{2, {"bob", kAlive}}}, std::vector<RobotId>{1, 2});
  absentees.update(8.0, {{2, {"bob", kAlive}}}, std::vector<RobotId>{1, 2});
  CHECK(text_of(absentees, 3.0).empty());
  absentees.update(9.0, {{2, {"bob", kAlive}}}, std::vector<RobotId>{1, 2});
  CHECK(text_of(absentees, 3.0) == "robot 7 silent 3 ");
  // Robots of which only others know have a name, also if they have never been members.
  absentees.update(10.0,
                   {{2, {"bob", kAlive}}, {7, {"carol", kReported}}, {9, {"dave", kReported}}},
                   std::vector<RobotId>{1, 2});
  CHECK(text_of(absentees, 3.0) == "carol silent 4 ");
  CHECK(text_of(absentees, 5.0).empty());
}

TEST_CASE("A robot that is noticed is unmet, and awaited for a time, until it is met") {
  UnmetPeers alone({});
  alone.update(0.0, {}, {});
  CHECK(alone.awaits(5.9));
  CHECK_FALSE(alone.awaits(6.0));
  UnmetPeers unmet({"10.0.0.7"});
  Peer bob;
  bob.identity.name = "bob";
  const std::map<std::string, std::string> noticed = {{to_string(bob.identity), "no keys"}};
  unmet.update(0.0, {}, noticed);
  CHECK(unmet.reasons() == noticed);
  CHECK(unmet.awaits(29.9));
  CHECK_FALSE(unmet.awaits(30.0));
  unmet.update(1.0, {{bob}}, {});
  CHECK(unmet.reasons().empty());
  CHECK_FALSE(unmet.awaits(1.0));

  SECTION("a named host counts only while no robot is noticed") {
    unmet.update(2.0, {}, {});
    CHECK(unmet.reasons().begin()->first == "dds.peers 10.0.0.7");
    unmet.update(3.0, {{bob}}, {});
    CHECK(unmet.reasons().empty());
  }
  SECTION("a participant whose name is in parentheses stays for ten seconds") {
    unmet.update(2.0, {{bob}}, {{"a participant (10.0.0.9)", "hears nothing"}});
    unmet.update(11.0, {{bob}}, {});
    CHECK(unmet.reasons().size() == 1);
    unmet.update(13.0, {{bob}}, {});
    CHECK(unmet.reasons().empty());
  }
  SECTION("a robot that has ended stays if it was unmet for some time") {
    for (const double now_s : {2.0, 8.0}) alone.update(now_s, {}, noticed);
    alone.update(19.0, {}, {});
    CHECK(alone.reasons() == noticed);
  }
}

}  // namespace
}  // namespace km
