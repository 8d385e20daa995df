#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/dds/entity.hpp"
#include "runtime/dds/robot_identity.hpp"

namespace km {

/// kLost: became silent. kLeft: announced its end. kReported: known only through other robots.
enum class PeerState { kAlive, kLost, kLeft, kReported };

/// Last known state of another robot of the team.
struct Peer {
  RobotIdentity identity;
  PeerState state = PeerState::kAlive;
  std::string addresses;  ///< Network locators it announced.
};

enum class PeerEventKind {
  kJoined,     ///< First received.
  kReported,   ///< First reported by other robots.
  kLost,       ///< Silent for longer than dds.liveliness_s.
  kReturned,   ///< Received again, same boot id.
  kResumed,    ///< Same robot id, other boot id of the same incarnation: its keyframes are
               ///< unchanged.
  kLeft,       ///< Ended regularly.
  kRestarted,  ///< Same robot id, another incarnation: its keyframe indices now mean other
               ///< keyframes. With boot id 0: another robot has taken the place of this one.
  kRefused,    ///< Ignored because of another protocol version, unreadable user data, refused
               ///< keys, too many robots, the id of a present robot, or forged announcements.
  kConflict,   ///< This robot's id belongs to a robot that had it first: this one must end.
};

/// Trust in the messages of a participant.
enum class Standing {
  kUnknown,   ///< No data are known yet.
  kOutsider,  ///< Not a robot, or refused.
  kTwin,      ///< Claims this robot's id.
  kRival,     ///< Claims the id of another known process, or is not present yet.
  kArriving,  ///< Owner of its robot id, but not all nodes know yet that the former incarnation has
              ///< ended.
  kAdmitted,  ///< Owner of its robot id.
};

struct PeerEvent {
  PeerEventKind kind;
  RobotIdentity identity;  ///< Identity of the peer; default if it could not be read.
  std::string text;        ///< One line for people.
  bool direct = true;      ///< False if other robots have reported it.
};

/// Determines the present robots: turns DDS reports about participants and the liveliness of their
/// status writers, in any order, into peers and events. Deterministic: time comes in [s], with any
/// origin. Memory is bounded, independent of what other participants announce.
///
/// A robot is present while its participant's user data is accepted and its status writer alive;
/// the expiry of the participant (dds.lease_s) changes nothing. Any program can forge
/// announcements, so a participant may be announced with several identities. It has the first
/// accepted one, until one of its statuses names the last accepted one: see prove(). An id belongs
/// to the first process that is received with it, as long as this process is received; then to the
/// next process. If there are kMaxRobots, a new robot takes the place of the one that has been lost
/// for longest, and waits if all are present. A robot that has lost its place joins again like a
/// new one.
///
/// Any program can announce participants, so only kMaxParticipants are remembered. A further one
/// takes the place of the oldest participant that is neither alive nor a robot of the team. Not
/// thread-safe.
class PeerTable {
 public:
  static constexpr std::size_t kMaxRobots = 64;
  static constexpr std::size_t kMaxParticipants = 256;
  static constexpr std::size_t kMaxFormer = 64;

  /// Decides by the credentials whether a robot is accepted. Returns null, or the reason of a
  /// refusal (a string literal).
  using Admit =
      std::function<const char*(const RobotIdentity& identity, std::string_view credentials)>;

  /// With `admit`, a robot is present only after prove() is also called for it, because its
  /// credentials could be replayed. A participant that has proven its identity keeps it, even if
  /// DDS reports that it has gone and announces it again. A process whose id another process has
  /// taken over does not get it back, because its messages could be replayed.
  explicit PeerTable(const RobotIdentity& self, Admit admit = {})
      : self_(self), admit_(std::move(admit)) {}

  /// Adds a peer that the former process of this robot knew. The peer counts as lost until a
  /// message from the peer arrives.
  void recall(const RobotIdentity& identity);

  /// Handles a report of other robots about a robot that this one does not receive directly. The
  /// event is kReported for a new robot, and kResumed or kRestarted if another process of it was
  /// known.
  void reported(const RobotIdentity& identity);

  /// A participant announced itself (again) with this user data. Empty addresses: as before.
  void participant(const Guid& guid, std::string_view user_data, const std::string& addresses);
  void participant_gone(const Guid& guid);
  /// False if its announcement was not received, or discarded in favour of others. Once the
  /// participant is alive, pass its announcement again.
  [[nodiscard]] bool is_announced(const Guid& guid) const;

  /// Discards the reports of DDS: this robot now has another network, or another address.
  void network_changed();

  /// These processes are no members of the team any more. They are lost, and later messages are
  /// refused.
  void expel(const std::vector<TeamPeer>& processes);

  /// Notes that a status of the participant names this process; with `admit`, that its seal has
  /// proven this. Changes nothing if the participant was not announced as this process.
  void prove(const Guid& guid, const TeamPeer& process);

  /// Notes that all nodes have handled the event of this process; only then are its messages
  /// delivered.
  void restart_handled(const TeamPeer& restarted);

  /// Notes that the status writer with this GUID is alive, silent, or closed.
  void alive(const Guid& guid);
  void silent(const Guid& guid);
  void closed(const Guid& guid);

  /// Handles a status of a process with this robot's own id. The arguments state how long that
  /// process and this one have been running, both [s]. The younger process yields if it is new
  /// itself, so no process can take the id of an older one. If both began at nearly the same time
  /// and both stay, the one with the higher boot id yields.
  void twin_received(const Guid& guid, double its_uptime_s, double own_uptime_s);

  /// kOpen: another process with this robot's id was received, and neither has yielded yet.
  /// kKept: there was such a process.
  enum class SameId { kNone, kKept, kOpen };
  [[nodiscard]] SameId same_id() const;

  /// Events since the last call, in order.
  [[nodiscard]] std::vector<PeerEvent> take_events() { return std::exchange(events_, {}); }

  /// Ascending by robot id.
  [[nodiscard]] std::vector<Peer> peers() const;

  /// The announced identity, if it could be read and accepted.
  [[nodiscard]] std::optional<RobotIdentity> identity_of(const Guid& guid) const;

  [[nodiscard]] Standing standing(const Guid& guid) const;

  /// The last accepted announcement of the participant, if it contradicts identity_of().
  [[nodiscard]] std::optional<TeamPeer> later_claim_of(const Guid& guid) const;

  /// True if statuses of participants arrive that are no robots of the team.
  [[nodiscard]] bool receives_strangers() const;

  /// True if no robot is received, although robots are announced that never were. Forged
  /// announcements with other addresses have this effect.
  [[nodiscard]] bool is_isolated() const;

  /// Such participants, by name or address, with the reason.
  [[nodiscard]] std::map<std::string, std::string> unmet() const;

  /// Number of participants that were announced with contradicting data.
  [[nodiscard]] std::size_t forged_announcements() const { return forged_; }

  /// The process that has this id, or had it last.
  [[nodiscard]] std::optional<TeamPeer> current(RobotId robot) const;
  /// True unless another process has taken the id over since.
  [[nodiscard]] bool is_current(const TeamPeer& sender) const;
  /// True from the report of another incarnation until all nodes know of it.
  [[nodiscard]] bool is_arriving(RobotId robot) const;

 private:
  // Another process with this robot's id, at its first status.
  struct Twin {
    double met_s = 0.0;    // uptime of this process
    bool decided = false;  // which of the two keeps the id
  };
  struct Participant {
    std::optional<RobotIdentity> identity;  // identity; nullopt until accepted
    std::optional<RobotIdentity> later;     // last accepted identity, if it contradicts the first
    std::string addresses;
    std::string claimed;   // name and id of the last refused announcement
    std::string refusal;   // reason of the last refusal; empty once an identity is accepted
    std::size_t data = 0;  // hash of the last user data; 0: none, 1: not that of a robot
    bool forged = false;   // announced with contradicting data
    bool announced = false;
    bool proven = false;  // also after DDS reports its end, which any program can forge
    bool alive = false;
    bool was_alive = false;
    bool warned = false;  // it was logged that it has to wait for its id or a place
    std::optional<Twin> twin;
    std::uint64_t arrival = 0;  // order of first reports, or of becoming alive
  };
  struct KnownPeer {
    Peer peer;
    Guid guid{};
    bool arriving = false;                   // true until all nodes know of the new incarnation
    std::uint64_t lost = 0;                  // order in which robots were lost
    std::vector<std::uint64_t> former = {};  // boot ids of former processes, oldest first
  };

  [[nodiscard]] static std::string name_of(const Participant& participant);
  [[nodiscard]] const char* why_unmet(const Guid& guid, const Participant& participant) const;
  [[nodiscard]] std::string why_refused(const Announcement& announcement) const;
  void take_announcement(const Guid& guid, Participant& participant, std::string_view user_data);
  void appear_if_there(const Guid& guid, Participant& participant);
  void appear(const Guid& guid, Participant& participant);
  [[nodiscard]] bool is_former(const KnownPeer& known, const RobotIdentity& identity) const;
  void become(KnownPeer& known, Peer peer, const Guid& guid, bool arriving);
  void take_over(KnownPeer& known, const Guid& guid, const Participant& participant);
  bool make_place(const RobotIdentity& newcomer);
  void fill_place();
  void give_way(const Guid& guid, PeerState state, PeerEventKind kind, const char* text);
  [[nodiscard]] bool is_robot(const Guid& guid, const Participant& participant) const;
  Participant& remember(const Guid& guid);
  void emit(PeerEventKind kind, const RobotIdentity& identity, const std::string& text,
            bool direct = true);

  RobotIdentity self_;
  Admit admit_;
  std::map<Guid, Participant> participants_;
  std::map<RobotId, KnownPeer> peers_;
  std::uint64_t arrivals_ = 0;
  std::size_t forged_ = 0;
  bool has_met_twin_ = false;
  std::vector<PeerEvent> events_;
};

}  // namespace km
