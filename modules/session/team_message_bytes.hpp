#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/session/team_messages.hpp"

namespace km {

/// Largest number of public poses in a message.
inline constexpr std::size_t kMaxPublicPoses = 1U << 20U;
/// Largest message [bytes].
inline constexpr std::size_t kMaxTeamMessageBytes = 1U << 24U;

/// Kinds of messages, in the order of TeamMessage.
enum class TeamMessageKind : std::uint8_t { kStatus, kSession, kMemberPoses, kReliable };
[[nodiscard]] inline TeamMessageKind kind_of(const TeamMessage& message) {
  return static_cast<TeamMessageKind>(message.index());
}

/// Encodes a message for the network: its members in order of declaration, without its sender and
/// its receiver. Ids, indices and counts are varints, ascending ones as differences. Public poses
/// are seven floats, all other real numbers are doubles. Decoding restores everything to the last
/// bit, except for T_odom_first and T_frame_world, whose rotations are sent as quaternions.
[[nodiscard]] std::vector<std::uint8_t> encode(const TeamMessage& message);

/// A message as it arrives: its bytes with what the network knows of it.
struct EncodedTeamMessage {
  TeamMessageKind kind = TeamMessageKind::kStatus;
  TeamPeer sender = {};  ///< The robot that sent the message first.
  RobotId to = 0;        ///< Receiver of a reliable message.
  std::span<const std::uint8_t> bytes = {};
};

/// Decodes untrusted bytes. It refuses everything that encode() never writes: numbers that are not
/// finite or out of range, lists that are not ascending or have invalid entries. Its memory is
/// proportional to their size, whatever counts they contain.
[[nodiscard]] Decoded<TeamMessage> decode_team_message(const EncodedTeamMessage& message);

}  // namespace km
