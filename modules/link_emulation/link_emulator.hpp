#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "modules/link_emulation/link_trace.hpp"

namespace km {

/// Part of a run [s since its start]; its end is no part of it.
struct RunSpan {
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool contains(double time_s) const { return from_s <= time_s && time_s < to_s; }
};

/// What the way from one robot to another is like.
struct LinkPlan {
  LinkTrace course{{{.bytes_per_s = std::numeric_limits<double>::infinity()}}};
  double jitter_s = 0.0;  ///< Further delay, uniform from 0 to this: frames may overtake others.
  double loss = 0.0;      ///< Probability of a frame.
  double queue_bytes = 64e3;  ///< What waits to be sent off, and is; a frame beyond it is dropped.
  std::vector<RunSpan> outages = {};
  double range_m = std::numeric_limits<double>::infinity();  ///< Further apart: not heard.
};

/// For a while, robots of different groups do not hear each other.
struct LinkPartition {
  RunSpan when;
  std::vector<std::size_t> group_of;  ///< By robot.
};

/// A robot's position in the world of all at an instant of the run.
struct TimedPosition {
  double time_s = 0.0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< [m]
};

/// What the links between some robots, numbered from 0, go through in a run.
struct LinkScript {
  unsigned seed = 1;
  std::size_t robots = 0;
  std::vector<LinkPlan> links;  ///< That from a to b at [a * robots + b].
  std::vector<LinkPartition> partitions = {};
  /// Of each robot, with increasing times; straight lines between positions, before the first and
  /// after the last as there. Needed where a link has a range.
  std::vector<std::vector<TimedPosition>> paths = {};

  [[nodiscard]] LinkPlan& link(std::size_t from, std::size_t to) {
    return links[from * robots + to];
  }
};

/// Why a frame is lost.
enum class LinkLoss { kPartition, kOutage, kRange, kQueue, kChance };
inline constexpr std::size_t kLinkLosses = 5;
/// In the order of the enum, as in names of columns.
inline constexpr std::array<const char*, kLinkLosses> kLinkLossNames = {"partition", "outage",
                                                                        "range", "queue", "loss"};

/// An Ethernet frame without its checksum.
using EthernetFrame = std::string;

/// Address of robot `robot`, locally administered.
[[nodiscard]] std::array<std::uint8_t, 6> ethernet_address(std::size_t robot);

/// A frame that is there.
struct LinkDelivery {
  std::size_t from = 0;
  std::size_t to = 0;
  double sent_s = 0.0;
  double due_s = 0.0;
  EthernetFrame frame = {};
};

struct FrameTally {
  std::uint64_t frames = 0;
  std::uint64_t bytes = 0;

  void add(const EthernetFrame& frame) {
    ++frames;
    bytes += frame.size();
  }
  bool operator==(const FrameTally&) const = default;
};

/// What became of the frames of a link. What is in none of `delivered` and `lost` is on its way.
struct LinkCounts {
  FrameTally in;
  FrameTally delivered;
  std::array<FrameTally, kLinkLosses> lost;  ///< By LinkLoss.
  double delay_sum_s = 0.0;                  ///< From in to out, of what is delivered.
  double delay_max_s = 0.0;

  bool operator==(const LinkCounts&) const = default;
};

/// The air, or the wires, between robots: takes frames of each and decides for every other robot
/// that a frame is for whether it arrives there, and when. A frame is lost if at the time it is
/// sent the two are in different groups of a partition, the link is out, the robots are too far
/// apart, or the queue is full, which is emptied at the link's rate; or by chance, after it has
/// been sent off. What is on its way arrives, also when the link goes out meanwhile.
///
/// The same script and the same frames at the same times give the same result. Every ordered pair
/// has a random stream of its own, of which each frame takes as much whatever becomes of it: the
/// chance of the n-th frame from a to b depends on the seed, a, b and n alone. Pure: time comes in
/// [s since the start of the run]. Not thread-safe.
class LinkEmulator {
 public:
  /// Throws std::invalid_argument if the script lacks links, paths that a range needs or groups, or
  /// a number in it cannot be.
  explicit LinkEmulator(LinkScript script);

  /// A frame that robot `from` sends: to the robot whose ethernet_address() it bears, or, by
  /// broadcast and multicast, to all others. Frames for anybody else vanish uncounted. Times must
  /// not decrease.
  void send(std::size_t from, double now_s, const EthernetFrame& frame);

  /// The frames that are due, in the order in which they are; of several at once, as they were
  /// sent.
  [[nodiscard]] std::vector<LinkDelivery> due(double now_s);

  /// When the next frame is due, if one is on its way.
  [[nodiscard]] std::optional<double> next_s() const;

  [[nodiscard]] std::size_t robots() const { return script_.robots; }
  [[nodiscard]] const LinkCounts& counts(std::size_t from, std::size_t to) const;

 private:
  struct State {
    std::mt19937 rng;
    double sent_off = -std::numeric_limits<double>::infinity();  // as LinkTrace::capacity_until()
    LinkCounts counts = {};
  };
  void send_over(std::size_t from, std::size_t to, double now_s, const EthernetFrame& frame);
  [[nodiscard]] std::optional<LinkLoss> cut(const LinkPlan& link, std::size_t from, std::size_t to,
                                            double now_s) const;
  [[nodiscard]] Eigen::Vector3d position(std::size_t robot, double now_s) const;

  LinkScript script_;
  std::vector<State> states_;                       // as the links of the script
  std::multimap<double, LinkDelivery> on_the_way_;  // by time; equal ones in the order of insertion
};

/// A table of what became of the frames of each ordered pair of robots, called by `names`: columns
/// from, to, frames and bytes in and delivered, frames and bytes lost by each of kLinkLossNames,
/// and mean and greatest delay [s] of what is delivered, empty if nothing is.
[[nodiscard]] std::string links_csv(const LinkEmulator& emulator,
                                    const std::vector<std::string>& names);

}  // namespace km
