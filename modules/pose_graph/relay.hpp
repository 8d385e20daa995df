#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "modules/core/team_links.hpp"
#include "modules/pose_graph/team_messages.hpp"

namespace km {

using TeamMessagePtr = std::shared_ptr<const TeamMessage>;

/// What became of a message that has arrived.
enum class [[nodiscard]] Arrival{
    kNew,       ///< For this robot to read.
    kRepeated,  ///< Not newer than what is known of its origin.
    kPassedOn,  ///< A letter to another robot.
    kLost,      ///< A letter to a robot that no links lead to, or one that has gone in a circle.
    kRefused,   ///< Of another process of its robot than the one that is known, or one too many.
    kNoRoom,    ///< The robot that hands it over has made this one hold too much already.
};

/// One robot's part in carrying the team's messages over whatever links there are.
///
/// Statuses, sessions and poses go to all robots of the team; of those of one origin the newest of
/// each kind counts. A robot that learns a newer one passes it on to the robots it hears, but not
/// to those that its origin or the robot that handed it over has told itself, as far as the told
/// links say: where all hear each other nothing is sent twice. A robot that is (again) heard is
/// handed what it cannot have from those it hears. What has been lost all the same shows in the
/// hash of what a robot holds, which its status tells: robots that hear each other compare them, as
/// in epidemic routing by summary vectors (Vahdat and Becker, "Epidemic Routing for
/// Partially-Connected Ad Hoc Networks", 2000), here in eight bytes instead of a vector, and hand
/// on what is older than `period_s`, more and more rarely while that does not help.
///
/// Letters go hop by hop along shortest paths, each copy over each robot once.
/// Deterministic; not thread-safe.
class Relay {
 public:
  Relay(TeamPeer self, double period_s) : self_(self), period_s_(period_s) {}

  /// A link that has gone is told for so long as if it were still there [s]: many come back at
  /// once, and nobody else needs to know.
  static constexpr double kPatience_s = 3.0;

  /// Of all that one robot hands over so much is held [octets in memory]; what is beyond is not
  /// taken. Statuses, sessions and public poses of a thousand keyframes of a hundred robots fit.
  static constexpr std::size_t kMaxHeldFromOne = 4U << 20U;

  /// `peer` is heard directly from now on, or no more.
  void link_up(TeamPeer peer, double now_s);
  void link_down(RobotId robot, double now_s);
  /// Time has passed.
  void step(double now_s);

  /// Sends a message of this robot, under the next number (letters: copy) of its kind, to all that
  /// are to have it. `hears` and `holds` of a status are filled in. Returns the number of parcels.
  std::size_t say(TeamMessage message, double now_s);
  /// Sends the last status again to those that hear this robot, with what it holds by now.
  void repeat_status(double now_s);

  /// A message that `from` has handed over.
  Arrival receive(RobotId from, const TeamMessagePtr& message, double now_s);

  /// What is to be sent, in order; empty thereafter.
  [[nodiscard]] std::vector<Parcel> take_parcels() { return std::exchange(parcels_, {}); }

  /// Robots that are heard directly, or were kPatience_s ago; ascending.
  [[nodiscard]] std::vector<TeamPeer> hears() const;
  [[nodiscard]] const TeamLinks& links() const { return links_; }
  /// Grows when links() changes.
  [[nodiscard]] std::uint64_t links_version() const { return links_version_; }
  /// Where a letter to `to` goes next: to itself if it is heard directly, else to the one that is
  /// and has the shortest path, other than `from`; of several to the lowest. nullopt if there is
  /// none.
  [[nodiscard]] std::optional<RobotId> next_hop(RobotId to, std::optional<RobotId> from = {}) const;
  /// Hash of all that is held.
  [[nodiscard]] std::uint64_t holds() const;

 private:
  static constexpr std::size_t kFlooded = 3;  // kinds: TeamStatus, Session, MemberPoses
  struct Held {
    TeamMessagePtr message;
    std::uint32_t number = 0;
    double learned_s = 0.0;
    RobotId from = 0;       // who has handed it over
    std::size_t bytes = 0;  // none of this robot's own
  };
  struct Origin {
    std::uint64_t boot = 0;
    std::array<std::optional<Held>, kFlooded> newest = {};
  };
  struct Served {
    std::uint32_t number = 0;
    double sent_s = 0.0;
    bool confirmed = false;  // it was the neighbour that has shown it
  };
  struct Neighbour {
    std::uint64_t boot = 0;
    std::map<std::pair<RobotId, std::size_t>, Served> served = {};  // by origin and kind
    double repair_s = 0.0;                                          // not before
    double patience_s = 0.0;
  };
  // Copies of letters of one robot to another that have passed.
  struct Passed {
    std::uint64_t boot = 0;
    std::set<std::uint32_t> copies = {};
  };

  [[nodiscard]] bool accepts(const TeamPeer& origin);
  [[nodiscard]] bool hold(std::optional<Held>& held, Held newer);
  [[nodiscard]] bool heard_by_someone(const TeamPeer& peer) const;
  void meet(const TeamPeer& peer);
  void tell_links(const TeamStatus& status);
  void renew_links();
  void renew_own_links();
  void pass_on(RobotId from, RobotId origin, std::size_t kind, double now_s);
  void compare(const TeamStatus& status, double now_s);
  void send(RobotId next, RobotId origin, std::size_t kind, double now_s);
  Arrival route(RobotId from, const TeamMessagePtr& message);

  TeamPeer self_;
  double period_s_;
  TeamLinks links_;
  std::uint64_t links_version_ = 0;
  std::map<RobotId, Origin> origins_;  // this robot included
  struct Gone {
    std::uint64_t boot = 0;
    double since_s = 0.0;
  };
  std::map<RobotId, std::size_t> held_from_;  // octets, by who has handed them over
  std::map<RobotId, Neighbour> direct_;
  std::map<RobotId, Gone> gone_;                          // from there, not longer than kPatience_s
  std::map<std::pair<RobotId, RobotId>, Passed> passed_;  // by sender and addressee
  std::map<RobotId, std::uint32_t> copies_;               // of own letters
  std::array<std::uint32_t, kFlooded> numbers_ = {};      // of own messages
  std::vector<Parcel> parcels_;
};

}  // namespace km
