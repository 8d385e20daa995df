#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

/// Messages with more are refused.
inline constexpr std::size_t kMaxPublicPoses = 1U << 20U;
/// No message is longer [bytes].
inline constexpr std::size_t kMaxTeamMessageBytes = 1U << 24U;

/// The form in which a message crosses the network: a byte for its kind, then its members in order
/// of declaration. Ids, indices and counts are varints, ascending ones as differences; public poses
/// are seven floats, everything else that is real a double. Other than T_odom_first and
/// T_frame_world, whose rotations are told as quaternions, all of it comes back to the last bit.
[[nodiscard]] std::vector<std::uint8_t> encode(const TeamMessage& message);

/// Trusts nothing: refuses what encode() never writes, numbers that are not finite or not what they
/// stand for, lists that are not ascending or contain what they must not. Needs memory in
/// proportion to `bytes`, whatever they claim.
[[nodiscard]] Decoded<TeamMessage> decode_team_message(std::span<const std::uint8_t> bytes);

}  // namespace km
