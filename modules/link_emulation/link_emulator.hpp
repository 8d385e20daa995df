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

/// Interval of a run [s since its start], half open.
struct RunSpan {
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool contains(double time_s) const { return from_s <= time_s && time_s < to_s; }
};

/// Properties of the link from one robot to another.
struct LinkPlan {
  LinkTrace trace{{{.bytes_per_s = std::numeric_limits<double>::infinity()}}};
  /// Replaces the rate of `trace`; frames count without their Ethernet header.
  std::optional<PacketSchedule> packets = {};
  double jitter_s = 0.0;  ///< Additional delay, uniform from 0 to this value, by which frames may
                          ///< overtake others.
  double loss = 0.0;      ///< Probability that a frame is lost.
  double queue_bytes = 64e3;  ///< Maximum size of the waiting frames and the one being sent; frames
                              ///< beyond it are dropped.
  std::vector<RunSpan> outages = {};
  double range_m = std::numeric_limits<double>::infinity();  ///< Maximum distance of two robots
                                                             ///< that receive each other.
};

/// Interval in which robots of different groups do not receive each other.
struct LinkPartition {
  RunSpan when;
  std::vector<std::size_t> group_of;  ///< Group of each robot.
};

/// Position of a robot in the common world frame at an instant of its recording.
struct PathPoint {
  double time_s = 0.0;                                ///< [s since the start of the recording]
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< [m]
};

/// Links between `robots` robots during a run. The robots have the numbers from 0.
struct LinkScript {
  unsigned seed = 1;
  std::size_t robots = 0;
  std::vector<LinkPlan> links;  ///< The link from a to b is at [a * robots + b].
  std::vector<LinkPartition> partitions = {};
  double rate = 1.0;  ///< Seconds of the recordings per second of the run.
  /// Positions of each robot with increasing times. They are interpolated linearly, and constant
  /// before the first and after the last. Required if a link has a range.
  std::vector<std::vector<PathPoint>> paths = {};

  [[nodiscard]] LinkPlan& link(std::size_t from, std::size_t to) {
    return links[from * robots + to];
  }
};

/// Reason why a frame is lost.
enum class LinkLoss { kPartition, kOutage, kRange, kQueue, kChance };
inline constexpr std::size_t kLinkLosses = 5;
/// The names are in the order of the enum, and are used in names of columns.
inline constexpr std::array<const char*, kLinkLosses> kLinkLossNames = {"partition", "outage",
                                                                        "range", "queue", "loss"};

/// An Ethernet frame without its checksum.
using EthernetFrame = std::string;

/// Address of robot `robot`, locally administered.
[[nodiscard]] std::array<std::uint8_t, 6> ethernet_address(std::size_t robot);

/// A frame on its way, or one that has arrived.
struct SentFrame {
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

/// Statistics of the frames of a link. Frames in none of `delivered` and `lost` are still on their
/// way.
struct LinkCounts {
  FrameTally in;
  FrameTally delivered;
  std::array<FrameTally, kLinkLosses> lost;  ///< Lost frames, indexed by LinkLoss.
  double delay_sum_s = 0.0;                  ///< Sum over the delivered frames.
  double delay_max_s = 0.0;

  bool operator==(const LinkCounts&) const = default;
};

/// Radio or cables between robots: takes the frames of each robot and decides for every addressee
/// whether and when the frame arrives. A frame is lost if its robots are in different groups of a
/// partition or too far apart when it is sent. It is also lost during an outage of the link or
/// if its queue is full; the queue drains at the rate of the link. A frame can also be lost by
/// chance after it has left the queue. A frame on its way arrives even if the link fails meanwhile.
///
/// Equal scripts and equal frames at equal times give equal results. Every ordered pair has a
/// random generator of its own, and each frame draws equally many numbers. So the random numbers of
/// the n-th frame from a to b depend only on the seed, a, b and n. No clock is read: times are
/// arguments [s since the start of the run]. Not thread-safe.
class LinkEmulator {
 public:
  /// Throws std::invalid_argument if a pair of robots has no link, or a number of a link is out of
  /// its bounds. Also throws it if a link has a range but a robot has no path, and if a partition
  /// has no group for a robot. Also throws it for a path that is empty or goes back in time.
  explicit LinkEmulator(LinkScript script);

  /// The recording of `robot` is at `recorded_s` [s since its start] and continues at the rate of
  /// the script. Without this call it starts with the run and never waits.
  void set_progress(std::size_t robot, double now_s, double recorded_s);

  /// Sends a frame of robot `from` to the robot whose ethernet_address() it bears, or, by broadcast
  /// and multicast, to all others. Frames to other addresses are dropped and not counted. Times
  /// must not decrease.
  void send(std::size_t from, double now_s, const EthernetFrame& frame);

  /// The frames that are due, in the order of their times; frames due at one time are in the order
  /// of sending.
  [[nodiscard]] std::vector<SentFrame> due(double now_s);

  /// Time at which the next frame is due; nullopt if no frame is on its way or none ever arrives.
  [[nodiscard]] std::optional<double> next_s() const;

  [[nodiscard]] std::size_t robots() const { return script_.robots; }
  [[nodiscard]] const LinkCounts& counts(std::size_t from, std::size_t to) const;

 private:
  struct Progress {
    double at_s = 0.0;
    double recorded_s = 0.0;
  };
  struct State {
    std::mt19937 rng;
    /// capacity_until() of the link at the time when the last queued frame has been sent [bytes].
    double queue_end = -std::numeric_limits<double>::infinity();
    LinkCounts counts = {};
  };
  void send_over(std::size_t from, std::size_t to, double now_s, const EthernetFrame& frame);
  [[nodiscard]] std::optional<LinkLoss> loss_of(const LinkPlan& link, std::size_t from,
                                                std::size_t to, double now_s) const;
  [[nodiscard]] Eigen::Vector3d position(std::size_t robot, double now_s) const;

  LinkScript script_;
  std::vector<Progress> progress_;              // last known progress of each robot
  std::vector<State> states_;                   // states in the order of the script's links
  std::multimap<double, SentFrame> in_flight_;  // deliveries by time; those of equal time in
                                                // the order of insertion
};

/// A table of the frames of each ordered pair of robots, with their `names`.
/// Columns: from, to, frames and bytes in and delivered, frames and bytes lost by each of
/// kLinkLossNames, mean and greatest delay [s] of the delivered frames. The delays are empty if no
/// frame was delivered.
[[nodiscard]] std::string links_csv(const LinkEmulator& emulator,
                                    const std::vector<std::string>& names);

}  // namespace km
