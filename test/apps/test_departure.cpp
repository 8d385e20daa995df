#include <catch2/catch.hpp>

#include <vector>

#include "apps/robot/departure.hpp"

namespace km {
namespace {

constexpr double kSettle_s = 2.0;
constexpr double kLimit_s = 60.0;

TEST_CASE("A robot alone leaves once its graph has been quiet", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  CHECK(departure.update(0.0, {.activity = 1}) == RobotPhase::kRunning);
  const Departure::Inputs done{.input_ended = true, .graph_settled = true, .activity = 2};
  CHECK(departure.update(10.0, done) == RobotPhase::kFinished);
  CHECK(departure.update(11.0, done) == RobotPhase::kSettled);
  CHECK(departure.reason() == nullptr);
  departure.update(13.0, done);
  CHECK(departure.reason() != nullptr);
}

TEST_CASE("A robot serves a peer that is still running, up to the limit", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  const std::vector<RobotPhase> peers = {RobotPhase::kSettled, RobotPhase::kRunning};
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
  const std::vector<RobotPhase> peers = {RobotPhase::kSettled};
  Departure::Inputs inputs{
      .input_ended = true, .graph_settled = true, .activity = 0, .present_peers = peers};
  departure.update(4.0, inputs);
  inputs.activity = 1;  // a closure arrived
  CHECK(departure.update(5.5, inputs) == RobotPhase::kFinished);
  CHECK(departure.update(6.5, inputs) == RobotPhase::kSettled);
  CHECK(departure.reason() == nullptr);
  departure.update(8.5, inputs);
  CHECK(departure.reason() != nullptr);
}

TEST_CASE("A settled robot goes as soon as a peer says that it leaves", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  std::vector<RobotPhase> peers = {RobotPhase::kSettled, RobotPhase::kSettled};
  Departure::Inputs inputs{
      .input_ended = true, .graph_settled = true, .activity = 0, .present_peers = peers};
  departure.update(9.0, inputs);
  CHECK(departure.reason() == nullptr);
  peers[1] = RobotPhase::kLeaving;
  inputs.graph_settled = false;  // not while there is work
  departure.update(9.1, inputs);
  CHECK(departure.reason() == nullptr);
  inputs.graph_settled = true;
  departure.update(9.2, inputs);
  CHECK(departure.reason() != nullptr);
}

TEST_CASE("A robot whose graph never settles leaves at the limit", "[departure]") {
  Departure departure(kSettle_s, kLimit_s);
  const Departure::Inputs busy{.input_ended = true, .graph_settled = false};
  CHECK(departure.update(0.0, busy) == RobotPhase::kFinished);
  CHECK(departure.reason() == nullptr);
  CHECK(departure.update(kLimit_s, busy) == RobotPhase::kFinished);
  CHECK(departure.reason() != nullptr);
}

}  // namespace
}  // namespace km
