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

/// Maximum number of processes whose keys are kept.
inline constexpr std::size_t kMaxAdmitted = 256;
/// Maximum number of processes of one robot whose keys are kept.
inline constexpr std::size_t kMaxAdmittedPerRobot = 4;

/// Key for messages to all robots, numbered by its owner.
struct TeamKey {
  std::uint32_t number = 0;
  SealingKey key;
};

/// Keys and certificate of an admitted process.
struct AdmittedPeer {
  Certificate certificate;
  std::string credentials = {};  ///< Credentials as the process announces them.
  ExchangeKey exchange{};
  SealingKey to_peer, from_peer;
  std::vector<TeamKey> team_keys;  ///< Team keys of the process by number; empty before its first
                                   ///< key message.
};

/// The admitted processes, at most as many as the bounds above. When a bound is reached, the
/// process that has been silent for longest is removed. Processes without any decrypted message are
/// removed first, because their credentials may be replayed recordings. Not thread-safe.
class AdmittedPeers {
 public:
  /// Keys of a process; nullptr if it is not admitted. The pointer is valid until the next change.
  [[nodiscard]] AdmittedPeer* find(const TeamPeer& peer);
  [[nodiscard]] const AdmittedPeer* find(const TeamPeer& peer) const;

  /// Adds a process that is not yet admitted.
  void add(const TeamPeer& peer, AdmittedPeer admitted);

  /// Notes that a message of the process has been decrypted. Does nothing for an unknown process.
  void received(const TeamPeer& peer);

  /// Erases processes for whose certificate `lapsed` returns true; returns them in ascending order.
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
    bool has_sent = false;
    std::uint64_t last_turn = 0;
  };
  using Entries = std::map<TeamPeer, Entry>;

  // If [begin, end) has `most` processes or more, removes one of them: the one that has been silent
  // for longest, but first those of which no message has been decrypted.
  void make_room(Entries::iterator begin, Entries::iterator end, std::size_t most);

  Entries peers_;
  std::uint64_t turn_ = 0;  // counts admissions and messages
};

}  // namespace km
