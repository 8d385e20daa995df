#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "modules/session/team_messages.hpp"

namespace km {

/// How far a robot is in a session.
enum class SessionState : std::uint8_t {
  kEntering,      ///< It waits for the poses of members before it, to enter their frame.
  kGathering,     ///< It is in the frame, and waits for the poses of all members.
  kSolving,       ///< Its solver runs.
  kLooking,       ///< It has a solution without the deferred closures, and waits for all members.
  kSolvingAgain,  ///< The solver of its second look runs.
  kSolved,        ///< It has the solution, and waits for that of all members.
  kFailed,        ///< Its solver cannot complete the session.
  kDone,          ///< The session has ended, and all members have the solution.
  kLeft,          ///< It has ended here; this robot has a solution, other members may lack theirs.
  kAbandoned,     ///< It has ended here without a solution.
};

enum class SessionEvent : std::uint8_t {
  kEntered,      ///< The poses of this robot are in the frame of the session.
  kGathered,     ///< The poses of all members have arrived.
  kDeferred,     ///< The solver has finished, and closures are left for a second look.
  kConverged,    ///< The solver has finished.
  kBroken,       ///< There is no solver, or it has failed.
  kCompleted,    ///< All members have the solution.
  kInterrupted,  ///< A member is lost or has failed, or the team continues without this robot.
};

struct SessionTransition {
  SessionState from;
  SessionEvent event;
  SessionState to;
};

/// All transitions. Other events leave the state as it is.
inline constexpr std::array kSessionTransitions = [] {
  using enum SessionState;
  using enum SessionEvent;
  return std::to_array<SessionTransition>({
      {kEntering, kEntered, kGathering},
      {kGathering, kGathered, kSolving},
      {kSolving, kDeferred, kLooking},
      {kSolving, kConverged, kSolved},
      {kSolving, kBroken, kFailed},
      {kLooking, kGathered, kSolvingAgain},
      {kSolvingAgain, kConverged, kSolved},
      {kSolvingAgain, kBroken, kFailed},
      {kSolved, kCompleted, kDone},
      {kLeft, kCompleted, kDone},  // the members that seemed to be lost were not
      {kEntering, kInterrupted, kAbandoned},
      {kGathering, kInterrupted, kAbandoned},
      {kSolving, kInterrupted, kAbandoned},
      {kLooking, kInterrupted, kAbandoned},
      {kSolvingAgain, kInterrupted, kAbandoned},
      {kFailed, kInterrupted, kAbandoned},
      {kSolved, kInterrupted, kLeft},
  });
}();

[[nodiscard]] constexpr SessionState next_state(SessionState state, SessionEvent event) {
  for (const auto& [from, on, to] : kSessionTransitions)
    if (from == state && on == event) return to;
  return state;
}

/// True if the session has not ended for the robot.
[[nodiscard]] constexpr bool is_running(SessionState state) {
  return state < SessionState::kDone;
}

/// The stage that a robot in this state has sent to the others; nullopt if it has sent none.
[[nodiscard]] constexpr std::optional<MemberStage> stage_of(SessionState state) {
  using enum SessionState;
  if (state == kGathering || state == kSolving) return MemberStage::kEntered;
  if (state == kLooking || state == kSolvingAgain) return MemberStage::kLooked;
  if (state == kSolved || state == kDone || state == kLeft) return MemberStage::kSolved;
  if (state == kFailed) return MemberStage::kFailed;
  return std::nullopt;
}

}  // namespace km
