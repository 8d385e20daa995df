#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "modules/core/robot_identity.hpp"
#include "modules/security/certificate.hpp"
#include "modules/security/credentials.hpp"

namespace km {

/// Processes of robots that keys are kept of at most, and those of one robot.
inline constexpr std::size_t kMaxAdmitted = 256;
inline constexpr std::size_t kMaxAdmittedPerRobot = 4;

/// A key for messages to all; its owner counts the keys it draws.
struct TeamKey {
  std::uint32_t number = 0;
  SealingKey key;
};

/// What is known of a process that was admitted.
struct AdmittedPeer {
  Certificate certificate;
  std::string credentials = {};  ///< As it shows them.
  ExchangeKey exchange{};
  SealingKey to_peer, from_peer;
  std::vector<TeamKey> team_keys;  ///< Its own, by number; none before its first key message.
};

/// The processes that were admitted. There are never more than the bounds above: the one that has
/// been silent for longest makes room; those of which no message ever opened go first, for they may
/// be recordings. Not thread-safe.
class AdmittedPeers {
 public:
  /// nullptr if it is not admitted. Valid until the next change.
  [[nodiscard]] AdmittedPeer* find(const TeamPeer& peer);
  [[nodiscard]] const AdmittedPeer* find(const TeamPeer& peer) const;

  /// Adds one that is not there yet.
  void add(const TeamPeer& peer, AdmittedPeer admitted);

  /// A message of its opened. Nothing happens if it is not known.
  void heard(const TeamPeer& peer);

  void erase(const TeamPeer& peer) { peers_.erase(peer); }

  /// Erases those whose certificate `lapsed(certificate)`; returns them in ascending order.
  template <typename Lapsed>
  [[nodiscard]] std::vector<TeamPeer> erase_if(const Lapsed& lapsed) {
    std::vector<TeamPeer> erased;
    for (const auto& [peer, entry] : peers_)
      if (lapsed(entry.admitted.certificate)) erased.push_back(peer);
    for (const TeamPeer& peer : erased) peers_.erase(peer);
    return erased;
  }

  [[nodiscard]] std::size_t size() const { return peers_.size(); }

 private:
  struct Entry {
    AdmittedPeer admitted;
    bool has_spoken = false;
    std::uint64_t last_turn = 0;
  };
  using Entries = std::map<TeamPeer, Entry>;

  // Erases the least worth keeping of [begin, end), if there are `most` or more.
  void make_room(Entries::iterator begin, Entries::iterator end, std::size_t most);

  Entries peers_;
  std::uint64_t turn_ = 0;  // counts admissions and messages
};

}  // namespace km
