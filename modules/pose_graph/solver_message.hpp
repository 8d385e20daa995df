#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>

#include "modules/pose_graph/newton/newton_messages.hpp"
#include "modules/pose_graph/pgo_messages.hpp"
#include "modules/pose_graph/robust/gnc_messages.hpp"

namespace km {

/// The sender cannot go on: the session's graph is refused, or its numbers are.
struct SolverGivesUp {};

using SolverContent = std::variant<SolverGivesUp, NewtonHello, NewtonShare, GncHello, GncShare>;

/// What a robot contributes to one exchange of a session that is solved by exchanges: every member
/// sends its n-th message when it has the others' n-1 before. So nobody is ever more than one
/// ahead, and of each robot the last two messages are all that anyone can still need.
struct SolverMessage {
  PgoPeer sender;
  PgoSessionId session;
  std::uint32_t sequence = 0;  ///< Of the sender in this session, from 0.
  SolverContent content;
};

using SolverMessagePtr = std::shared_ptr<const SolverMessage>;

/// Which of a robot's last two messages it replaces: it is the one before the last then.
[[nodiscard]] constexpr std::size_t slot_of(std::uint32_t sequence) {
  return sequence % 2;
}

/// Bytes of `message` as it travels, to a few per cent.
[[nodiscard]] std::size_t approximate_bytes(const SolverMessage& message);

}  // namespace km
