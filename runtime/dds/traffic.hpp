#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/ids.hpp"
#include "runtime/dds/qos.hpp"

namespace km {

enum class Direction { kOut, kIn };

/// Messages and their serialized bytes, DDS's 4-byte encoding header included; RTPS, UDP and IP
/// headers are not.
struct TrafficCount {
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;

  void add(std::uint64_t size) {
    ++messages;
    bytes += size;
  }
  void add(const TrafficCount& other) {
    messages += other.messages;
    bytes += other.bytes;
  }
  bool operator==(const TrafficCount&) const = default;
};

/// Effect of the budget on the messages of one topic since the start, see SendSchedule. Bytes count
/// once per message, independent of the number of receivers. Each published
/// message was sent at once or is counted in one of these fields.
struct HeldBack {
  TrafficCount delayed;     ///< Sent after waiting for the budget.
  TrafficCount waiting;     ///< Waiting now for the budget or for a receiver.
  TrafficCount superseded;  ///< Never sent: replaced by a newer state.
  TrafficCount dropped;     ///< Never sent: no budget, no room, too late, or the end of the run.

  bool operator==(const HeldBack&) const = default;
};

/// Traffic of one topic with one peer since the start.
struct PeerTraffic {
  std::string topic;
  TrafficCategory category = TrafficCategory::kOther;
  Direction direction = Direction::kOut;
  std::optional<RobotId> peer;  ///< Empty: a reader that is no robot of the team, or all peers.
  TrafficCount count;           ///< Out: once per reader matched when it was written.
  std::uint64_t retransmitted_bytes = 0;  ///< Out; for a topic to all, in the row without peer.
};

/// Traffic on one topic in one direction since the start. Fields marked Out or In are zero in the
/// other direction.
struct TopicTraffic {
  std::string topic;
  TrafficCategory category = TrafficCategory::kOther;
  Direction direction = Direction::kOut;
  TrafficCount count = {};       ///< Out: once per message. In: new messages from known robots.
  std::uint64_t duplicates = 0;  ///< In: messages that had arrived before.
  HeldBack held = {};            ///< Out: effect of the budget.
  /// Number of messages that were refused or could not be written, by reason.
  std::map<std::string, std::uint64_t> refused = {};
};

struct TrafficSnapshot {
  std::vector<PeerTraffic> peers;
  std::vector<TopicTraffic> topics;

  /// Bytes of a category over all topics and peers, with retransmissions.
  [[nodiscard]] std::uint64_t bytes(Direction direction, TrafficCategory category) const;
};

/// Writes traffic.csv: counts over time, a row whenever one has changed. Columns: time_s,
/// direction, topic, category, peer ("*" if there is no single one), messages, bytes,
/// retransmitted_bytes. Directions are in and out and, with a budget, delayed, superseded, dropped
/// and waiting: see HeldBack. All are cumulative, except for waiting, which is the present value.
class TrafficCsv {
 public:
  /// Writes the header line, or continues after the rows of `former` processes, whose counts are
  /// added. `output` outlives this.
  explicit TrafficCsv(std::ostream& output, std::string_view former = {});
  void append(double time_s, const TrafficSnapshot& snapshot);

 private:
  // Messages, bytes, retransmitted bytes.
  using Counts = std::array<std::uint64_t, 3>;
  // Direction, topic, category and peer of a row: "out,bow_vectors,place_recognition,7".
  using Subject = std::string;

  void append(double time_s, const std::string& direction, const PeerTraffic& row);

  std::ostream& output_;
  std::map<Subject, Counts> former_, written_;
};

}  // namespace km
