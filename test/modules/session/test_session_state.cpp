#include "modules/session/session_state.hpp"
#include "test/support/test.hpp"

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

TEST_CASE("Each state and event has at most one row, and without a row nothing changes") {
  for (const SessionState state : kStates)
    for (const SessionEvent event : kEvents) {
      CAPTURE(int(state), int(event));
      SessionState expected = state;
      for (const auto& [from, on, to] : kSessionTransitions) {
        if (from != state || on != event) continue;
        CHECK(expected == state);
        expected = to;
        CHECK(to != from);
        // The stage that a robot has sent never goes back while the session runs.
        if (is_running(to) && stage_of(from)) CHECK(stage_of(to) >= stage_of(from));
      }
      CHECK(next_state(state, event) == expected);
    }
}

TEST_CASE("A session can be interrupted in each state, and completed by those with the solution") {
  for (const SessionState state : kStates) {
    CHECK_FALSE(is_running(next_state(state, SessionEvent::kInterrupted)));
    const bool completes = next_state(state, SessionEvent::kCompleted) == SessionState::kDone;
    CHECK(completes == (stage_of(state) == MemberStage::kSolved));
  }
}

}  // namespace
}  // namespace km
