#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/security/key_types.hpp"

namespace km {

/// What the team's authority says of a robot: it has this id, this name and this key, for a time.
struct Certificate {
  std::string team;  ///< For people; what tells teams apart is the authority's key.
  RobotId robot = 0;
  std::string name;
  PublicKey key{};
  std::int64_t valid_from_s = 0;   ///< [s since 1970-01-01 UTC]
  std::int64_t valid_until_s = 0;  ///< [s since 1970-01-01 UTC], inclusive.
  Signature signature{};           ///< By the authority, over all of the above.
};

/// A certificate taken back before its time. Its key says which.
struct RevokedCertificate {
  PublicKey key{};
  RobotId robot = 0;
  std::string name;

  bool operator==(const RevokedCertificate&) const = default;
};

/// All that the authority has taken back; a list that it signs as a whole.
struct Revocations {
  std::uint64_t number = 0;  ///< Of two lists, the one with the higher number counts.
  std::vector<RevokedCertificate> revoked;
  Signature signature{};  ///< By the authority.
};

/// Signs with the authority's key.
void sign(Certificate& certificate, const SigningKey& authority);
void sign(Revocations& revocations, const SigningKey& authority);

/// True if the authority of this public key signed exactly this.
[[nodiscard]] bool is_signed_by(const PublicKey& authority, const Certificate& certificate);
[[nodiscard]] bool is_signed_by(const PublicKey& authority, const Revocations& revocations);

/// nullptr, or why a certificate of the authority's does not hold at `now_s`
/// [s since 1970-01-01 UTC] (a string literal): not valid yet or any more, or revoked.
[[nodiscard]] const char* lapse_of(const Certificate& certificate, const Revocations& revocations,
                                   std::int64_t now_s);

/// The same, or that it is not signed by the authority. `revocations` are believed as they are.
[[nodiscard]] const char* refusal_of(const Certificate& certificate, const PublicKey& authority,
                                     const Revocations& revocations, std::int64_t now_s);

}  // namespace km
