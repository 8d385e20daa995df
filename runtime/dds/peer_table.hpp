#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/dds/robot_identity.hpp"

namespace km {

/// Identity of a DDS participant on the network.
using Guid = std::array<std::uint8_t, 16>;

/// kLost: went silent. kLeft: said good-bye.
enum class PeerState { kAlive, kLost, kLeft };

/// Another robot of the team, as last heard of.
struct Peer {
  RobotIdentity identity;
  PeerState state = PeerState::kAlive;
  std::string addresses;  ///< Network locators it announced.
};

enum class PeerEventKind {
  kJoined,     ///< First heard of.
  kLost,       ///< Silent for longer than dds.liveliness_s.
  kReturned,   ///< Heard again, same boot.
  kLeft,       ///< Ended in order.
  kRestarted,  ///< Same robot id, other boot.
  kRefused,    ///< Another protocol version, or unreadable user data: not talked to.
  kConflict,   ///< Two living processes claim one robot id.
};

struct PeerEvent {
  PeerEventKind kind;
  RobotIdentity identity;  ///< Of the peer; default where it could not be read.
  std::string text;        ///< One line for people.
};

/// Who is there: turns what DDS reports about participants and the liveliness of their status
/// writers, in any order, into peers and events. Pure: time comes in [s], any origin.
///
/// A robot is present while its participant's user data is accepted and its status writer alive;
/// that the participant expires (dds.lease_s) changes nothing. Not thread-safe.
class PeerTable {
 public:
  PeerTable(const RobotIdentity& self, double liveliness_s);

  /// A participant announced itself (again) with this user data. Other programs are ignored.
  void participant(const Guid& guid, std::string_view user_data, const std::string& addresses,
                   double now_s);
  void participant_gone(const Guid& guid);

  /// Its status writer is alive, silent, or closed.
  void alive(const Guid& guid, double now_s);
  void silent(const Guid& guid);
  void closed(const Guid& guid);

  /// Finds conflicts that only time can tell from a restart.
  void tick(double now_s);

  /// Events since the last call, in order.
  [[nodiscard]] std::vector<PeerEvent> take_events() { return std::exchange(events_, {}); }

  /// Ascending by robot id.
  [[nodiscard]] std::vector<Peer> peers() const;

  /// Identity of a participant that may be talked to, or could before it was gone; nullopt for a
  /// stranger or a refused one.
  [[nodiscard]] std::optional<RobotIdentity> identity_of(const Guid& guid) const;

  /// True if this boot of `robot` was ever accepted.
  [[nodiscard]] bool has_met(RobotId robot, std::uint64_t boot) const;

 private:
  struct Participant {
    std::optional<RobotIdentity> identity;  // if accepted
    std::string addresses;
    bool announced = false;
    bool alive = false;
  };
  struct KnownPeer {
    Peer peer;
    Guid guid{};
  };
  struct Rival {  // alive when another boot of its robot appeared
    Guid guid{};
    double since_s = 0.0;
  };

  void appear(const Guid& guid, double now_s);
  void meet_again(KnownPeer& known, const Guid& guid, const Participant& participant, double now_s);
  void emit(PeerEventKind kind, const RobotIdentity& identity, const std::string& text);
  KnownPeer* peer_at(const Guid& guid);

  RobotIdentity self_;
  double conflict_after_s_;
  std::map<Guid, Participant> participants_;
  std::map<RobotId, KnownPeer> peers_;
  std::vector<Rival> rivals_;
  std::set<std::pair<RobotId, std::uint64_t>> met_;
  std::vector<PeerEvent> events_;
};

}  // namespace km
