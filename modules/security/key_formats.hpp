#pragma once

#include <filesystem>
#include <string>

#include "modules/security/certificate.hpp"

namespace km {

/// The folder of a team's authority, and the files of a robot's folder of keys.
inline constexpr const char* kAuthorityFolder = "authority";
inline constexpr const char* kSecretKeyFile = "secret_key.txt";
inline constexpr const char* kCertificateFile = "certificate.txt";
inline constexpr const char* kAuthorityFile = "authority.txt";
inline constexpr const char* kRevocationsFile = "revocations.txt";

/// The public part of a team's authority.
struct Authority {
  std::string team;
  PublicKey key{};
};

/// Each read function throws std::runtime_error that names file, line, value and the remedy. None
/// checks a signature.
[[nodiscard]] SigningKey read_secret_key(const std::filesystem::path& file);
[[nodiscard]] Certificate read_certificate(const std::filesystem::path& file);
[[nodiscard]] Authority read_authority(const std::filesystem::path& file);
[[nodiscard]] Revocations read_revocations(const std::filesystem::path& file);

/// `owner` names the owner of the secret in a comment of the file.
void write_secret_key(const std::filesystem::path& file, const SigningKey& key,
                      const std::string& owner);
void write_certificate(const std::filesystem::path& file, const Certificate& certificate);
void write_authority(const std::filesystem::path& file, const Authority& authority);
void write_revocations(const std::filesystem::path& file, const Revocations& revocations);

/// First digits of a public key, enough for people to distinguish keys of a team.
[[nodiscard]] std::string fingerprint_of(const PublicKey& key);

}  // namespace km
