#include <algorithm>
#include <catch2/catch.hpp>

#include "modules/session/session_state.hpp"

namespace km {
namespace {

constexpr SessionState kStates[] = {SessionState::kEntering,     SessionState::kGathering,
                                    SessionState::kSolving,      SessionState::kLooking,
                                    SessionState::kSolved,       SessionState::kFailed,
                                    SessionState::kSolvingAgain, SessionState::kDone,
                                    SessionState::kLeft,         SessionState::kAbandoned};
constexpr SessionEvent kEvents[] = {SessionEvent::kEntered,    SessionEvent::kGathered,
                                    SessionEvent::kDeferred,   SessionEvent::kConverged,
                                    SessionEvent::kBroken,     SessionEvent::kCompleted,
                                    SessionEvent::kInterrupted};

TEST_CASE("Every row of the table of a session counts, and each state and event has one row",
          "[pose_graph][session]") {
  for (const auto& [from, event, to] : kSessionTransitions) {
    CAPTURE(int(from), int(event), int(to));
    CHECK(from != to);
    CHECK(next_state(from, event) == to);
  }
}

TEST_CASE("Events without a row change nothing", "[pose_graph][session]") {
  for (const SessionState state : kStates)
    for (const SessionEvent event : kEvents) {
      const bool has_row = std::ranges::any_of(kSessionTransitions, [&](const auto& row) {
        return row.from == state && row.event == event;
      });
      CAPTURE(int(state), int(event));
      CHECK((next_state(state, event) != state) == has_row);
    }
}

TEST_CASE("A session that runs can be interrupted, and does not run afterwards",
          "[pose_graph][session]") {
  for (const SessionState state : kStates)
    CHECK_FALSE(is_running(next_state(state, SessionEvent::kInterrupted)));
}

TEST_CASE("A session is completed only by a robot that has the solution", "[pose_graph][session]") {
  for (const SessionState state : kStates) {
    const bool completes = next_state(state, SessionEvent::kCompleted) == SessionState::kDone;
    CHECK(completes == (stage_of(state) == MemberStage::kSolved));
  }
}

TEST_CASE("The stage that a robot has sent never goes back while the session runs",
          "[pose_graph][session]") {
  for (const auto& [from, event, to] : kSessionTransitions)
    if (is_running(to) && stage_of(from)) CHECK(stage_of(to) >= stage_of(from));
}

}  // namespace
}  // namespace km
