#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "modules/core/decoded.hpp"
#include "modules/core/robot_identity.hpp"

namespace km {

/// "name (id 7)", for messages.
[[nodiscard]] std::string to_string(const RobotIdentity& identity);

/// Random boot id of a new incarnation that has not been resumed.
[[nodiscard]] std::uint64_t random_boot_id();

/// Announcement of a robot in the USER_DATA of its DDS participant:
/// "robot=7;name=alpha;proto=1;boot=0123456789abcdef", and in a team with keys ";keys=CREDENTIALS"
/// (see TeamSeal). Throws std::invalid_argument for a name that cannot be sent.
[[nodiscard]] std::string to_user_data(const RobotIdentity& identity,
                                       std::string_view credentials = {});

/// Data that a robot announces.
struct Announcement {
  RobotIdentity identity;
  std::string credentials;  ///< Empty: none.
};

/// Inverse of to_user_data() for untrusted bytes. Unknown keys are ignored.
[[nodiscard]] Decoded<Announcement> parse_user_data(std::string_view bytes);

/// True if the bytes have the form of a robot's announcement. Announcements of other programs are
/// ignored.
[[nodiscard]] bool claims_to_be_a_robot(std::string_view bytes);

}  // namespace km
