#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "modules/core/decoded.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/security/certificate.hpp"

namespace km {

/// X25519 (RFC 7748): public key from which two processes derive a common key.
using ExchangeKey = std::array<std::uint8_t, 32>;

/// Data that a process announces in addition to its identity. They are the parts of its certificate
/// that are not in the identity, and an X25519 key of this process, signed by the robot.
struct Credentials {
  std::array<std::uint8_t, 8> authority{};  ///< First bytes of the authority's public key, which
                                            ///< identify the team.
  PublicKey key{};
  std::int64_t valid_from_s = 0;
  std::int64_t valid_until_s = 0;
  Signature certificate{};  ///< Signature of the authority.
  ExchangeKey exchange{};
  Signature signature{};  ///< Signature of the robot over its identity, `exchange` and
                          ///< `certificate`.
};

/// Characters of to_text().
inline constexpr std::size_t kCredentialsLength = 290;

/// Makes and signs the credentials of the robot of `certificate`.
[[nodiscard]] Credentials make_credentials(const Certificate& certificate,
                                           const PublicKey& authority, const SigningKey& robot,
                                           const RobotIdentity& identity,
                                           const ExchangeKey& exchange);

/// Base 64 with '-' and '_' (RFC 4648, section 5), without padding.
[[nodiscard]] std::string to_text(const Credentials& credentials);

/// Inverse of to_text() for a text from an unknown sender. Each credentials value has exactly one
/// accepted text.
[[nodiscard]] Decoded<Credentials> parse_credentials(std::string_view text);

/// The certificate that the credentials claim for `identity`, in a team of this name.
[[nodiscard]] Certificate claimed_certificate(const Credentials& credentials,
                                              const RobotIdentity& identity,
                                              const std::string& team);

/// True if the owner of credentials.key signed `identity`, credentials.exchange and
/// credentials.certificate.
[[nodiscard]] bool is_signed_by_robot(const Credentials& credentials,
                                      const RobotIdentity& identity);

}  // namespace km
