#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "modules/core/robot_identity.hpp"

namespace km {

/// In the order of their numbers on the wire.
enum class RelayKind : std::uint8_t {
  kIntroduction,  ///< The origin is there: `content` is a RelayIntroduction.
  kBag,           ///< To all; `number` is the keyframe's index.
  kClosure,       ///< A letter to `to`; letters of an origin are numbered from 0, of either kind.
  kInlierSet,     ///< Likewise.
  kRequest,       ///< For keyframe `number` of `to`.
  kReply,         ///< Keyframe `number` of the origin, to `to`.
};

/// What robots hand on in the name of another one.
struct RelayMessage {
  RelayKind kind = RelayKind::kIntroduction;
  TeamPeer origin;
  RobotId to = 0;             ///< Not of kIntroduction and kBag.
  std::uint64_t to_boot = 0;  ///< Of a letter: only for the life of this process; 0: for any.
  std::uint32_t number = 0;
  std::uint8_t hops = 0;  ///< Of a request or an answer: robots that have passed it on.
  /// The topic's own type, serialised; of a letter that nobody needs any more, empty. In a team
  /// with keys the origin's signature is behind it (relay_endorsement.hpp), but for an
  /// introduction.
  std::vector<std::uint8_t> content = {};

  bool operator==(const RelayMessage&) const = default;
};

using RelayMessagePtr = std::shared_ptr<const RelayMessage>;

[[nodiscard]] constexpr bool is_letter(RelayKind kind) {
  return kind == RelayKind::kClosure || kind == RelayKind::kInlierSet;
}

/// From one robot to the next that hears it.
struct RelayParcel {
  RobotId neighbour = 0;  ///< Whom it goes to, or who has handed it over.
  RelayMessagePtr message;
};

}  // namespace km
