#include <catch2/catch.hpp>

#include <vector>

#include "apps/robot/departure.hpp"

namespace km {
namespace {

constexpr double kSettle_s = 2.0;
constexpr double kLimit_s = 60.0;
constexpr Departure::Present kSettled{RobotPhase::kSettled, 1};

TEST_CASE("A robot alone leaves once its graph has been quiet", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  CHECK(departure.update(0.0, {.activity = 1}).phase == RobotPhase::kRunning);
  const Departure::Inputs done{.input_ended = true, .graph_settled = true, .activity = 2};
  CHECK(departure.update(10.0, done).phase == RobotPhase::kFinished);
  CHECK(departure.update(11.0, done).phase == RobotPhase::kSettled);
  CHECK(departure.reason() == nullptr);
  departure.update(13.0, done);
  CHECK(departure.reason() != nullptr);
}

TEST_CASE("A robot serves a peer that is still running, up to the limit", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  const std::vector<Departure::Present> peers = {kSettled, {}};
  const Departure::Inputs waiting{
      .input_ended = true, .graph_settled = true, .activity = 0, .present_peers = peers};
  for (double now_s = 5.0; now_s < 5.0 + kLimit_s; now_s += 1.0) {
    departure.update(now_s, waiting);
    CHECK(departure.reason() == nullptr);
  }
  departure.update(5.0 + kLimit_s, waiting);
  CHECK(departure.reason() != nullptr);
}

TEST_CASE("New work after all had settled starts the wait again", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  const std::vector<Departure::Present> peers = {kSettled};
  Departure::Inputs inputs{
      .input_ended = true, .graph_settled = true, .activity = 0, .present_peers = peers};
  departure.update(4.0, inputs);
  inputs.activity = 1;  // a closure arrived
  CHECK(departure.update(5.5, inputs).phase == RobotPhase::kFinished);
  CHECK(departure.update(6.5, inputs).phase == RobotPhase::kSettled);
  CHECK(departure.reason() == nullptr);
  departure.update(8.5, inputs);
  CHECK(departure.reason() != nullptr);
}

TEST_CASE("A settled robot goes as soon as a peer says that it leaves", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  std::vector<Departure::Present> peers = {kSettled, kSettled};
  Departure::Inputs inputs{
      .input_ended = true, .graph_settled = true, .activity = 0, .present_peers = peers};
  departure.update(9.0, inputs);
  CHECK(departure.reason() == nullptr);
  peers[1].phase = RobotPhase::kLeaving;
  inputs.graph_settled = false;  // not while there is work
  departure.update(9.1, inputs);
  CHECK(departure.reason() == nullptr);
  inputs.graph_settled = true;
  departure.update(9.2, inputs);
  CHECK(departure.reason() != nullptr);
}

// A chain of robots that all poll ten times a second and hear their neighbours a poll later. Robot
// `restless` settles at `from_s` only. When each leaves [s].
std::vector<double> departures(std::size_t count, std::size_t restless, double from_s) {
  std::vector<Departure> robots(count, Departure(kSettle_s, kLimit_s));
  std::vector<Departure::Present> told(count);
  std::vector<double> left_s(count, 0.0);
  for (int poll = 0; poll < 600; ++poll) {
    const double now_s = 0.1 * poll;
    const auto before = told;
    for (std::size_t k = 0; k < count; ++k) {
      if (left_s[k] > 0.0) continue;
      std::vector<Departure::Present> heard;
      for (const std::size_t other : {k - 1, k + 1})
        if (other < count && (left_s[other] == 0.0 || now_s - left_s[other] < 1.0))
          heard.push_back(before[other]);
      told[k] = robots[k].update(now_s, {.input_ended = true,
                                         .graph_settled = k != restless || now_s >= from_s,
                                         .activity = 0,
                                         .present_peers = heard,
                                         .unheard = count - 1 - heard.size()});
      if (robots[k].reason() == nullptr) continue;
      told[k].phase = RobotPhase::kLeaving;
      left_s[k] = now_s;
    }
  }
  return left_s;
}

TEST_CASE("In a chain every robot waits for the one at the end, and then all go", "[departure]") {
  const std::size_t restless = GENERATE(0U, 3U, 7U);
  CAPTURE(restless);
  for (const double s : departures(8, restless, 20.0)) {
    CHECK(s >= 20.0);
    CHECK(s < 20.0 + 3.0 * kSettle_s);
  }
}

TEST_CASE("A robot whose graph never settles leaves at the limit", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  const Departure::Inputs busy{.input_ended = true, .graph_settled = false};
  CHECK(departure.update(0.0, busy).phase == RobotPhase::kFinished);
  CHECK(departure.reason() == nullptr);
  CHECK(departure.update(kLimit_s, busy).phase == RobotPhase::kFinished);
  CHECK(departure.reason() != nullptr);
}

}  // namespace
}  // namespace km
