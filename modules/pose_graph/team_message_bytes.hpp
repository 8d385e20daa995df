#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// Largest number of public poses in a message.
inline constexpr std::size_t kMaxPublicPoses = 1U << 20U;
/// Largest message [bytes].
inline constexpr std::size_t kMaxTeamMessageBytes = 1U << 24U;

/// Encodes a message for the network: a byte for its kind, then its members in order of
/// declaration. Ids, indices and counts are varints, ascending ones as differences. Public poses
/// are seven floats, all other real numbers are doubles. Decoding restores everything to the last
/// bit, except for T_odom_first and T_frame_world, whose rotations are sent as quaternions.
[[nodiscard]] std::vector<std::uint8_t> encode(const TeamMessage& message);

/// Decodes untrusted bytes. It refuses everything that encode() never writes: numbers that are not
/// finite or out of range, lists that are not ascending or have invalid entries. Its memory is
/// proportional to the size of `bytes`, whatever counts they contain.
[[nodiscard]] Decoded<TeamMessage> decode_team_message(std::span<const std::uint8_t> bytes);

}  // namespace km
