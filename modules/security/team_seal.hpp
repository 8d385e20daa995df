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

/// Bytes that sealing adds to a message for one robot: nonce 24, tag 16.
inline constexpr std::size_t kAddressedSealBytes = 24 + 16;

/// Bytes that sealing adds to a message to all: key number 4, nonce 24, tag 16, signature 64.
inline constexpr std::size_t kTeamSealBytes = 4 + 24 + 16 + 64;

/// Unencrypted fields of a message. All of them are authenticated: a message opens only with the
/// context with which it was sealed.
struct SealContext {
  std::string topic;
  TeamPeer sender;
  std::uint64_t number = 0;            ///< Number of the message, counted by its sender.
  std::array<std::uint8_t, 16> key{};  ///< Key of the envelope.
  std::optional<TeamPeer> addressee;   ///< None: the message is for every member of the team.
};

/// Result of open().
struct [[nodiscard]] Opened {
  enum class Status {
    kOpened,
    kNotYet,   ///< The necessary key may still arrive: keep the message and try again after the
               ///< next admit() or accept_key_message() for its sender. Keep a bounded number,
               ///< because senders outside the team can produce such messages, too.
    kRefused,  ///< The message will never open.
  };
  Status status = Status::kRefused;
  Octets content;                ///< Content if opened.
  const char* reason = nullptr;  ///< Reason if not opened, a string literal.
};

/// Changes of the membership by TeamSeal::update().
struct [[nodiscard]] MembershipChange {
  std::vector<TeamPeer> forgotten;
  bool new_key = false;  ///< Send key_message_for() to all peers again.
};

/// Seals the messages of one process of a robot to its team, and opens messages that it receives.
///
/// A message for one robot is encrypted by a key that only the two processes have. Each process
/// draws an X25519 key at its start, from which crypto_kx derives one key for each direction. A
/// message to all is encrypted by a key that its sender draws, and signed by the sender, so that no
/// member can forge messages of another. Encryption is XChaCha20-Poly1305. These keys end with the
/// process: a robot's long-lived secret that is found later does not open recorded messages.
///
/// Nonces are drawn at random, 24 bytes each. Two equal nonces under one key would reveal the
/// contents. Among 2^64 messages the probability of equal nonces is below 2^-64, and no counter has
/// to survive a crash.
///
/// Duties of the caller:
/// - It announces credentials() with its identity, and passes the credentials of other processes to
///   admit(). An unknown sender can record and replay credentials, so they do not prove that the
///   process runs. The first message of a process that opens and is not a repeated one proves this.
///   Only then may a new process of a robot replace an older one.
/// - It sends key_message_for(peer) to each newly admitted peer and, if update() says so, to all.
///   It repeats this message at times, because a peer that has removed and admitted this process
///   again has lost the key.
/// - It drops repeated messages. A sealed message can be recorded and opens again when it is
///   replayed. The caller therefore stores the numbers of received messages by (robot, boot).
///
/// Not thread-safe.
class TeamSeal {
 public:
  /// `own` is this process, and `now_s` is [s since 1970-01-01 UTC]. Throws std::invalid_argument
  /// if the keys belong to another robot (id or name), or are lapsed or revoked.
  TeamSeal(RobotKeys keys, const RobotIdentity& own, std::int64_t now_s);
  TeamSeal(const TeamSeal&) = delete;
  TeamSeal& operator=(const TeamSeal&) = delete;

  /// Credentials of this process: certificate, X25519 key, and the robot's signature over both and
  /// the identity. kCredentialsLength characters.
  [[nodiscard]] const std::string& credentials() const { return credentials_; }

  /// Checks the credentials of a process at `now_s` and stores its keys. Returns nullptr, or the
  /// reason of a refusal (a string literal): malformed, another authority, lapsed, revoked, another
  /// id or name than in the certificate, or an invalid signature. Repeated calls are harmless.
  ///
  /// At most kMaxAdmitted processes are stored, and at most kMaxAdmittedPerRobot of one robot. To
  /// make room, one of all processes, or of this robot's processes, is removed: the one that has
  /// been silent for longest. Processes of which no message has been decrypted are removed before
  /// all others.
  [[nodiscard]] const char* admit(const RobotIdentity& identity, std::string_view credentials,
                                  std::int64_t now_s);

  /// Certificate of a process that has these credentials, which any robot may have forwarded.
  /// Refuses as admit() does, but stores nothing; no message can be sealed for that process.
  [[nodiscard]] Decoded<Certificate> certified(const RobotIdentity& identity,
                                               std::string_view credentials,
                                               std::int64_t now_s) const;

  /// nullptr, or the reason why a formerly valid certificate is no longer valid at `now_s` (a
  /// string literal).
  [[nodiscard]] const char* why_lapsed(const Certificate& certificate, std::int64_t now_s) const {
    return why_invalid(certificate, revocations_, now_s);
  }

  /// Credentials of an admitted process; nullopt if it is not admitted.
  [[nodiscard]] std::optional<std::string> credentials_of(const TeamPeer& peer) const;

  /// Signs with this robot's long-lived key. `statement` begins with statement(), with a kind that
  /// no other signature uses.
  [[nodiscard]] Signature endorse(OctetView statement) const { return sign(statement, secret_); }

  [[nodiscard]] bool is_admitted(const TeamPeer& peer) const {
    return peers_.find(peer) != nullptr;
  }

  /// Applies a list of revocations and the time. Pass the list in use again to apply only the time.
  /// Removes processes whose certificate is revoked or not valid at `now_s`. Draws a new key for
  /// messages to all if the list has changed or a process was removed. Also draws one when
  /// the certificate of a process that has received the newest key has expired, even if this
  /// process was removed before. Throws std::invalid_argument without a change if the list is not
  /// the authority's, or older than the one in use.
  MembershipChange update(const Revocations& revocations, std::int64_t now_s);

  /// Message with the keys by which `peer` opens this process's messages to all, sealed for `peer`.
  /// nullopt if `peer` is not admitted.
  [[nodiscard]] std::optional<Octets> key_message_for(const TeamPeer& peer);

  /// Processes the result of key_message_for() by `from`. Returns nullptr, or the reason for a
  /// refusal (a string literal). Repeating a message changes nothing.
  [[nodiscard]] const char* accept_key_message(const TeamPeer& from, OctetView message);

  /// The sealed message. nullopt if the addressee is not admitted. Throws std::invalid_argument if
  /// `context` names another sender than this process, or this process as addressee.
  [[nodiscard]] std::optional<Octets> seal(const SealContext& context, OctetView content) const;

  /// Decrypts a message of an unknown participant. Succeeds only if the sender that `context` names
  /// is admitted and has sealed the message. The work is bounded by the size of the message. The
  /// signature is checked only after decryption, which fails for senders outside the team.
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
  std::vector<TeamKey> team_keys_;  // own keys by number; the last one seals
  // Time [s since 1970-01-01 UTC] at which a new team key is due: the earliest end of the
  // certificates of all processes that have received the newest key. Such a process may have been
  // removed from peers_ before.
  std::int64_t newest_key_expires_s_ = std::numeric_limits<std::int64_t>::max();
};

}  // namespace km
