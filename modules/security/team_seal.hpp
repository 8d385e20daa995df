#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/core/robot_identity.hpp"
#include "modules/security/admitted_peers.hpp"
#include "modules/security/credentials.hpp"
#include "modules/security/key_folder.hpp"
#include "modules/security/key_types.hpp"
#include "modules/security/signing.hpp"

namespace km {

/// Octets that sealing adds to a message for one robot: nonce 24, tag 16.
inline constexpr std::size_t kAddressedSealBytes = 24 + 16;

/// Octets that sealing adds to a message to all: key number 4, nonce 24, tag 16, signature 64.
inline constexpr std::size_t kTeamSealBytes = 4 + 24 + 16 + 64;

/// What goes with a message in clear. All of it is authenticated: a message opens only with the
/// context that it was sealed with.
struct SealContext {
  std::string_view topic;
  TeamPeer sender;
  std::uint64_t number = 0;            ///< Of the message, counted by its sender.
  std::array<std::uint8_t, 16> key{};  ///< Of the envelope.
  std::optional<TeamPeer> addressee;   ///< None: for every member of the team.
};

/// What open() made of a message.
struct [[nodiscard]] Opened {
  enum class Status {
    kOpened,
    kNotYet,   ///< A key is missing that may still come: keep the message and try again after the
               ///< next admit() or accept_key_message() for its sender. Keep a bounded number:
               ///< strangers can make such messages, too.
    kRefused,  ///< It will never open.
  };
  Status status = Status::kRefused;
  Octets content;                ///< If opened.
  const char* reason = nullptr;  ///< If not: a string literal.
};

/// What TeamSeal::update() changed.
struct [[nodiscard]] MembershipChange {
  std::vector<TeamPeer> forgotten;
  bool new_key = false;  ///< Send key_message_for() to all peers again.
};

/// Seals what one process of a robot sends to its team, and opens what it receives.
///
/// A message for one robot is encrypted by a key that only the two processes have: X25519 keys that
/// each draws at its start (crypto_kx, so that either direction has its own). A message to all is
/// encrypted by a key that its sender draws, and signed by the sender, so that no member can speak
/// for another. Encryption is XChaCha20-Poly1305. Keys are gone when the process ends: what was
/// recorded cannot be opened by a robot's long-lived secret found later.
///
/// Nonces are drawn at random, 24 octets each. Two equal ones under one key would give the contents
/// away; among 2^64 messages the probability of that is below 2^-64, and no counter has to survive
/// a crash.
///
/// What the caller does:
/// - announces credentials() with its identity; admits others by theirs, before anything else.
///   Credentials can be recorded and shown again by a stranger: they say who could be there, not
///   who is. A member lives once a message of its opens that is not a repeated one; only then may a
///   new process of a robot take the place of an older one.
/// - sends key_message_for(peer) to each newly admitted peer, again at times (a peer that forgot
///   this process and admitted it again has lost the key), and to all when update() says so.
/// - drops repeated messages. A sealed message can be recorded and shown again and opens again: the
///   caller keeps which numbers of (robot, boot) it has taken.
///
/// Not thread-safe.
class TeamSeal {
 public:
  /// For the process `own` at `now_s` [s since 1970-01-01 UTC]. Throws std::invalid_argument if the
  /// keys are another robot's (id or name), lapsed or revoked.
  TeamSeal(RobotKeys keys, const RobotIdentity& own, std::int64_t now_s);
  TeamSeal(const TeamSeal&) = delete;
  TeamSeal& operator=(const TeamSeal&) = delete;

  /// What this process shows others: certificate, a key of this start, and a signature over them
  /// and the identity. kCredentialsLength characters.
  [[nodiscard]] const std::string& credentials() const { return credentials_; }

  /// Checks what a process shows of itself at `now_s` and remembers its keys. nullptr, or why it is
  /// not a member (a string literal): not understood, another team's authority, lapsed, revoked,
  /// another id or name than the certificate's, a signature that is not its own. Admitting again is
  /// harmless. Beyond kMaxAdmitted, or kMaxAdmittedPerRobot of one robot, the one that has been
  /// silent for longest is forgotten; those whose messages never opened come first.
  [[nodiscard]] const char* admit(const RobotIdentity& identity, std::string_view credentials,
                                  std::int64_t now_s);

  /// The certificate of a process that shows these credentials, whoever has passed them on: refused
  /// as by admit(), but nothing is remembered, and nothing can be sealed for that process.
  [[nodiscard]] Decoded<Certificate> certified(const RobotIdentity& identity,
                                               std::string_view credentials,
                                               std::int64_t now_s) const;

  /// nullptr, or why a certificate that was good does not hold at `now_s` any more (a string
  /// literal).
  [[nodiscard]] const char* why_lapsed(const Certificate& certificate, std::int64_t now_s) const {
    return lapse_of(certificate, revocations_, now_s);
  }

  /// What an admitted process has shown; nullopt if it is not admitted.
  [[nodiscard]] std::optional<std::string> credentials_of(const TeamPeer& peer) const;

  /// Signs with this robot's long-lived key. `statement` begins as statement() makes it, with a
  /// kind that nothing else is signed under.
  [[nodiscard]] Signature endorse(OctetView statement) const { return sign(statement, secret_); }

  [[nodiscard]] bool is_admitted(const TeamPeer& peer) const {
    return peers_.find(peer) != nullptr;
  }

  /// A process that is gone: its keys are forgotten. Nothing happens if it is not known.
  void forget(const TeamPeer& peer) { peers_.erase(peer); }

  /// Takes a list of revocations (the same as before, to let time alone work) and the time: forgets
  /// members that are revoked or lapsed, and draws a new key for messages to all if the list is
  /// another one, or anyone who was given the last key has lapsed. Throws std::invalid_argument if
  /// the list is not the authority's, or older than the one in use; nothing has changed then.
  MembershipChange update(const Revocations& revocations, std::int64_t now_s);

  /// What lets `peer` open this process's messages to all: octets to send to it as they are, sealed
  /// for it. nullopt if it is not admitted.
  [[nodiscard]] std::optional<Octets> key_message_for(const TeamPeer& peer);

  /// Takes what key_message_for() of `from` gave. nullptr, or why it is refused (a string literal).
  /// The same message again changes nothing.
  [[nodiscard]] const char* accept_key_message(const TeamPeer& from, OctetView message);

  /// The sealed message. nullopt if the addressee is not admitted. Throws std::invalid_argument if
  /// `context` names another sender than this process, or this process as addressee.
  [[nodiscard]] std::optional<Octets> seal(const SealContext& context, OctetView content) const;

  /// The content of a message that anybody may have sent. The work is bounded by its size; a
  /// stranger's message costs no signature check.
  [[nodiscard]] Opened open(const SealContext& context, OctetView sealed);

 private:
  [[nodiscard]] Decoded<Certificate> certified(const Credentials& shown,
                                               const RobotIdentity& identity,
                                               std::int64_t now_s) const;
  bool agree(const TeamPeer& peer, AdmittedPeer& admitted) const;
  void draw_team_key();
  Octets seal_to_all(Octets associated, OctetView content) const;
  Opened open_for_self(const SealContext& context, OctetView sealed);
  Opened open_to_all(const SealContext& context, OctetView sealed);

  SigningKey secret_;
  std::string team_;
  PublicKey authority_{};
  TeamPeer self_;
  ExchangeKey exchange_{};
  Secret<32> exchange_secret_;
  std::string credentials_;
  Revocations revocations_;
  AdmittedPeers peers_;
  std::vector<TeamKey> team_keys_;  // own, by number; the last seals
  // [s since 1970-01-01 UTC] when the first of those who have the newest team key is no longer a
  // member: it may be gone from peers_ by then.
  std::int64_t holder_lapses_s_ = std::numeric_limits<std::int64_t>::max();
};

}  // namespace km
