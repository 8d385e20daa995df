#pragma once

#include "modules/security/signing.hpp"
#include "modules/security/team_seal.hpp"
#include "test/support/test.hpp"

namespace km {

inline constexpr std::int64_t kToyNow_s = 1'800'000'000;

/// A team's authority, without files.
class ToyTeam {
 public:
  explicit ToyTeam(std::string name = "survey") : name_(std::move(name)) {
    secret_ = make_signing_key();
    revocations_ = revoking({});
  }

  [[nodiscard]] PublicKey authority() const { return public_key_of(secret_); }
  [[nodiscard]] const Revocations& revocations() const { return revocations_; }

  /// Keys of a new robot, valid for `days` from `from_s`.
  [[nodiscard]] RobotKeys keys_of(RobotId robot, const std::string& name,
                                  std::int64_t from_s = kToyNow_s - 86400, int days = 10) const {
    RobotKeys keys;
    keys.secret = make_signing_key();
    keys.certificate = {.team = name_,
                        .robot = robot,
                        .name = name,
                        .key = public_key_of(keys.secret),
                        .valid_from_s = from_s,
                        .valid_until_s = from_s + 86400 * days};
    sign(keys.certificate, secret_);
    keys.authority = authority();
    keys.revocations = revocations_;
    return keys;
  }

  /// Next list of revocations, which contains only these certificates.
  [[nodiscard]] Revocations revoking(const std::vector<Certificate>& certificates) {
    Revocations list{.number = next_number_++, .revoked = {}};
    for (const Certificate& one : certificates)
      list.revoked.push_back({one.key, one.robot, one.name});
    sign(list, secret_);
    return list;
  }

 private:
  std::string name_;
  SigningKey secret_;
  Revocations revocations_;
  std::uint64_t next_number_ = 0;
};

[[nodiscard]] inline RobotIdentity toy_identity(RobotId robot, const std::string& name,
                                                std::uint64_t boot = 0) {
  return {.robot = robot, .name = name, .boot = boot != 0 ? boot : 1000U + robot};
}

/// A process of a robot of a team.
struct ToyMember {
  ToyMember(const ToyTeam& team, RobotId robot, const std::string& name, std::uint64_t boot = 0)
      : keys(team.keys_of(robot, name)),
        identity(toy_identity(robot, name, boot)),
        seal(keys, identity, kToyNow_s) {}

  /// Another start of the same robot.
  ToyMember(const ToyMember& former, std::uint64_t boot)
      : keys(former.keys),
        identity(toy_identity(keys.certificate.robot, keys.certificate.name, boot)),
        seal(keys, identity, kToyNow_s) {}

  [[nodiscard]] TeamPeer peer() const { return {identity.robot, identity.boot}; }

  [[nodiscard]] const char* admit(const ToyMember& other) {
    return seal.admit(other.identity, other.seal.credentials(), kToyNow_s);
  }

  RobotKeys keys;
  RobotIdentity identity;
  TeamSeal seal;
};

/// Each admits the other and accepts its key for messages to all.
inline void introduce(ToyMember& a, ToyMember& b) {
  REQUIRE(a.admit(b) == nullptr);
  REQUIRE(b.admit(a) == nullptr);
  REQUIRE(a.seal.accept_key_message(b.peer(), b.seal.key_message_for(a.peer()).value()) == nullptr);
  REQUIRE(b.seal.accept_key_message(a.peer(), a.seal.key_message_for(b.peer()).value()) == nullptr);
}

/// A message of `from`, for `to` or to all.
[[nodiscard]] inline SealContext toy_context(const ToyMember& from,
                                             std::optional<TeamPeer> to = std::nullopt) {
  return {.topic = "bow_vectors",
          .sender = from.peer(),
          .number = 77,
          .key = {1, 2, 3},
          .addressee = to};
}

[[nodiscard]] inline Octets toy_content(std::size_t size = 40) {
  Octets content(size);
  for (std::size_t i = 0; i < size; ++i) content[i] = static_cast<std::uint8_t>(31 * i + 7);
  return content;
}

[[nodiscard]] inline std::string reason_of(const char* refusal) {
  return refusal == nullptr ? "" : refusal;
}

}  // namespace km
