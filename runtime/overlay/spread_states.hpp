#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/overlay/known_robots.hpp"
#include "runtime/overlay/overlay_message.hpp"

namespace km {

/// Spreads states to all robots that links connect: of each origin and stream the newest counts.
///
/// A robot that receives a newer state forwards it to the robots that it receives directly. It
/// omits robots to which the origin or the previous robot has already sent it, according to the
/// reported links: if all robots receive each other, nothing is sent twice. A robot that is
/// received again gets all states whose origins it does not receive directly.
///
/// Lost states show in the hash of the numbers of all states that a robot holds, and whether they
/// are signed, which its status contains. Robots that receive each other compare these hashes, as
/// in epidemic routing by summary vectors (Vahdat and Becker, "Epidemic Routing for
/// Partially-Connected Ad Hoc Networks", 2000), here with eight bytes instead of a vector. If they
/// differ, a robot sends the states that are older than kRepairAfter_s, and repeats this ever more
/// rarely while the hashes still differ.
///
/// In a team with keys a robot signs its states as long as the team has robots out of its reach.
/// States without a signature are accepted only from their origin, and are not forwarded. Not
/// thread-safe.
class SpreadStates {
 public:
  /// Limit of the states held from one neighbour [bytes]; states beyond it are refused. Statuses,
  /// sessions and public poses of a thousand keyframes of a hundred robots fit.
  static constexpr std::size_t kMaxHeldFromOne = 4U << 20U;
  static constexpr double kRepairAfter_s = 1.0;
  /// Two robots that this one receives have this time to report a link between them, from its
  /// first meeting with one of them, or from the report of one end. States of a robot are not
  /// forwarded to the other meanwhile, nor is the robot introduced to it. 32 processes on two cores
  /// discover each other within three seconds, and two pairs of a robot mostly within one.
  static constexpr double kMeeting_s = 1.5;

  /// Both outlive this object; the packets to send are appended to `packets`.
  SpreadStates(KnownRobots& robots, std::vector<OverlayPacket>& packets)
      : robots_(robots), packets_(packets) {}

  /// Sends a state of this robot, with the next number of its stream, to all its neighbours.
  void publish(OverlayStream stream, std::vector<std::uint8_t> content, double now_s);
  /// True if a state is newer than the one that is held.
  [[nodiscard]] bool is_newer(const OverlayMessage& message) const;
  /// Stores and forwards a state whose origin is known and whose signature, if any, is valid.
  OverlayArrival arrive(RobotId from, const OverlayMessagePtr& message, double now_s);

  void connected(RobotId robot, double now_s);
  void disconnected(RobotId robot) { receivers_.erase(robot); }
  /// Discards the states of a robot.
  void forget(RobotId robot);
  /// The links of the team have changed: neighbours may lack states that do not arrive on other
  /// links any more.
  void links_changed(double now_s);
  /// Signs the states of this robot if robots out of reach now need signatures, and sends what is
  /// due.
  void step(double now_s);
  /// Compares the hash of a neighbour.
  void compare(RobotId robot, std::uint64_t hash, double now_s);

  /// Repairs the states that a neighbour lacks as soon as its hash shows it.
  void repair_soon(RobotId robot, double now_s);

  /// Hash of all states, or of those of one robot.
  [[nodiscard]] std::uint64_t hash() const;
  [[nodiscard]] std::uint64_t hash_of(RobotId robot) const;

 private:
  struct Held {
    OverlayMessagePtr message;
    double learned_s = 0.0;
    RobotId from = 0;  // neighbour that has sent it, or this robot
  };
  using Origin = std::array<std::optional<Held>, kStateStreams>;
  using Key = std::pair<RobotId, std::size_t>;  // origin and state_index()
  struct Served {
    std::uint32_t number = 0;
    double sent_s = 0.0;
    bool confirmed = false;  // the neighbour has shown that it has it
  };
  struct Receiver {
    double met_s = 0.0;
    std::map<Key, Served> served = {};
    std::map<Key, double> due_s = {};  // states to send then, unless they arrive another way
    bool differs = false;              // the last hash was another one
    double repair_s = 0.0;             // earliest time of the next repair
    double patience_s = kRepairAfter_s;
  };

  [[nodiscard]] const TeamLinks& links() const { return robots_.links(); }
  [[nodiscard]] bool hold(std::optional<Held>& held, Held newer);
  [[nodiscard]] bool may_forward(const Held& held) const;
  [[nodiscard]] std::size_t held_bytes(const Held& held) const;
  [[nodiscard]] bool may_be_linked(RobotId next, RobotId origin, double now_s) const;
  void repair(RobotId robot, double now_s);
  void pass_on(RobotId from, const Key& key, double now_s);
  void offer(RobotId next, const Key& key, double now_s);
  void send(RobotId next, const Key& key, double now_s);
  void send_to_all(const Key& key, double now_s);

  KnownRobots& robots_;
  std::vector<OverlayPacket>& packets_;
  std::map<RobotId, Origin> origins_;         // this robot included
  std::map<RobotId, std::size_t> held_from_;  // bytes, by the neighbour that has sent them
  std::map<RobotId, Receiver> receivers_;     // the neighbours
};

}  // namespace km
