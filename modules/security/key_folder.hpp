#pragma once

#include <filesystem>

#include "modules/security/certificate.hpp"

namespace km {

/// Keys on a robot: its own secret, and the public data with which it checks other robots.
struct RobotKeys {
  SigningKey secret;
  Certificate certificate;
  PublicKey authority{};
  Revocations revocations;
};

/// Reads a robot's folder as `kimera_multi_keys` writes it. Throws std::runtime_error that names
/// file, line, value and the remedy. Refuses a missing or malformed file, a secret that other users
/// may read, a secret that is not that of the certificate, and a signature that is not the
/// authority's. Does not check whether the certificate is valid at the present time.
[[nodiscard]] RobotKeys load_robot_keys(const std::filesystem::path& folder);

/// Reads only the list of revocations of a robot's folder, for TeamSeal::update(). Throws like
/// load_robot_keys().
[[nodiscard]] Revocations load_revocations(const std::filesystem::path& folder);

}  // namespace km
