#pragma once

#include <filesystem>
#include <vector>

#include "modules/security/certificate.hpp"

namespace km {

/// What a robot has of its team's keys: its own secret, and what it checks others by.
struct RobotKeys {
  SigningKey secret;
  Certificate certificate;
  PublicKey authority{};
  Revocations revocations;
};

/// Reads a robot's folder as `kimera_multi_keys` writes it. Throws std::runtime_error that names
/// file, line, value and the way out: a file that is missing or not understood, a secret that
/// others than its owner may read, parts that do not belong together, a signature that is not the
/// authority's. Does not check the time.
[[nodiscard]] RobotKeys load_robot_keys(const std::filesystem::path& folder);

/// Reads the folder's list of revocations alone, for TeamSeal::update(). Throws as above.
[[nodiscard]] Revocations load_revocations(const std::filesystem::path& folder);

}  // namespace km
