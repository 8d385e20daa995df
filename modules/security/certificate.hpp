#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/security/key_types.hpp"

namespace km {

/// Statement of the team's authority that a robot has this id, name and key during a time.
struct Certificate {
  std::string team;  ///< Name for people; the key of the authority identifies the team.
  RobotId robot = 0;
  std::string name;
  PublicKey key{};
  std::int64_t valid_from_s = 0;   ///< [s since 1970-01-01 UTC]
  std::int64_t valid_until_s = 0;  ///< [s since 1970-01-01 UTC], inclusive.
  Signature signature{};           ///< Signature of the authority over the fields above.
};

/// A certificate that is revoked before its end. Its key identifies it.
struct RevokedCertificate {
  PublicKey key{};
  RobotId robot = 0;
  std::string name;

  bool operator==(const RevokedCertificate&) const = default;
};

/// All revoked certificates, a list that the authority signs as a whole.
struct Revocations {
  std::uint64_t number = 0;  ///< The list with the higher number replaces the other.
  std::vector<RevokedCertificate> revoked;
  Signature signature{};  ///< Signature of the authority over the fields above.
};

/// Signs with the authority's key.
void sign(Certificate& certificate, const SigningKey& authority);
void sign(Revocations& revocations, const SigningKey& authority);

/// True if the authority with this public key signed exactly these fields.
[[nodiscard]] bool is_signed_by(const PublicKey& authority, const Certificate& certificate);
[[nodiscard]] bool is_signed_by(const PublicKey& authority, const Revocations& revocations);

/// nullptr if a certificate of the authority is valid at `now_s` [s since 1970-01-01 UTC];
/// otherwise the reason (a string literal): not valid yet, expired, or revoked.
[[nodiscard]] const char* why_invalid(const Certificate& certificate,
                                      const Revocations& revocations, std::int64_t now_s);

/// As why_invalid(), and also checks the signature of the authority on the certificate. Does not
/// check the signature of `revocations`.
[[nodiscard]] const char* why_refused(const Certificate& certificate, const PublicKey& authority,
                                      const Revocations& revocations, std::int64_t now_s);

}  // namespace km
