#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "modules/core/robot_identity.hpp"

namespace km {

/// Kind of the messages of one robot, the origin. The enumerators are in the order of their numbers
/// on the network.
enum class OverlayStream : std::uint8_t {
  kIntroduction,  ///< Announces the origin; `content` is an OverlayIntroduction. Not numbered.

  // States: the newest message of each origin and stream counts.
  kLinks,        ///< Robots that the origin receives directly; see encode_links().
  kTeamStatus,   ///< TeamStatus.
  kSession,      ///< Session.
  kMemberPoses,  ///< MemberPoses.

  // Calls: messages to `to`.
  kSolver,   ///< Message of a solver; `number` only distinguishes messages on their way.
  kRequest,  ///< Request for keyframe `number` of `to`.
  kReply,    ///< Keyframe `number` of the origin, for `to`.
  kWords,    ///< Points of keyframe `number` of the origin, for `to` and its request alone.

  // Events: every message counts, in any order.
  kBag,      ///< Bag of words for all robots; `number` is the keyframe's index.
  kClosure,  ///< Reliable message to `to`. An origin numbers its reliable messages of both streams
             ///< from 0.
  kInlierSet,  ///< Reliable message to `to`.
};

[[nodiscard]] constexpr bool is_state(OverlayStream stream) {
  return stream >= OverlayStream::kLinks && stream <= OverlayStream::kMemberPoses;
}
[[nodiscard]] constexpr bool is_call(OverlayStream stream) {
  return stream >= OverlayStream::kSolver && stream <= OverlayStream::kWords;
}
[[nodiscard]] constexpr bool is_reliable(OverlayStream stream) {
  return stream >= OverlayStream::kClosure;
}

inline constexpr std::size_t kStateStreams = 4;
/// Index of a state stream, below kStateStreams.
[[nodiscard]] constexpr std::size_t state_index(OverlayStream stream) {
  return static_cast<std::size_t>(stream) - static_cast<std::size_t>(OverlayStream::kLinks);
}

/// Message of one robot, the origin, that other robots forward.
struct OverlayMessage {
  OverlayStream stream = OverlayStream::kIntroduction;
  TeamPeer origin;
  RobotId to = 0;             ///< Only in calls and reliable messages.
  std::uint64_t to_boot = 0;  ///< In a reliable message: boot id of the only incarnation that it is
                              ///< for, or 0 for any.
  std::uint32_t number = 0;
  std::uint8_t hops = 0;  ///< In a call: number of robots that have forwarded it.
  /// In a team with keys: the content ends with the signature of the origin (endorsement.hpp).
  bool is_signed = false;
  /// Serialised message of the stream. It is empty in a reliable message that a newer one has
  /// replaced.
  std::vector<std::uint8_t> content = {};

  bool operator==(const OverlayMessage&) const = default;
};

using OverlayMessagePtr = std::shared_ptr<const OverlayMessage>;

/// Message on one hop, between a robot and a neighbour that receives it directly.
struct OverlayPacket {
  RobotId neighbour = 0;  ///< Receiver of a sent message, sender of a received one.
  OverlayMessagePtr message;
  bool is_own = false;  ///< The sender is the origin of the message.
};

/// Number of messages of one robot that another robot holds without a gap, from the first on.
struct OverlayHeld {
  TeamPeer origin;
  std::uint32_t bags = 0;      ///< 0 for an origin that is received directly.
  std::uint32_t reliable = 0;  ///< Number of reliable messages, see MessageStore.

  bool operator==(const OverlayHeld&) const = default;
};

/// Messages that a robot holds, as its status reports them to the robots that receive it directly.
struct OverlaySummary {
  std::uint64_t states = 0;  ///< Hash of the numbers of all states that it holds.
  /// One for each known robot that is not received directly, or whose reliable messages are held;
  /// ascending by robot. Empty if all robots receive each other directly all the time.
  std::vector<OverlayHeld> holds = {};
  std::uint64_t own_states = 0;  ///< Hash of its own states alone.
  /// In a team with keys: robots whose statuses arrive, but not their packets. They renew their DDS
  /// writers.
  std::vector<RobotId> missed = {};

  bool operator==(const OverlaySummary&) const = default;
};

/// Bytes that a stored message takes, its bookkeeping included.
[[nodiscard]] inline std::size_t stored_bytes(const OverlayMessage& message) {
  return message.content.size() + 96;
}

}  // namespace km
