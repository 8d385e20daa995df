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

/// What the budget has made of the messages of one topic since the start, see SendSchedule. Bytes
/// count once per message, however many robots it is for. What is published is the sum of what went
/// at once and of all of these.
struct HeldBack {
  TrafficCount delayed;     ///< Sent later than they could have been.
  TrafficCount waiting;     ///< To be sent now: for the budget, or for somebody to be there.
  TrafficCount superseded;  ///< Never sent: a newer state came before their turn.
  TrafficCount dropped;     ///< Never sent: no budget, or no room, or too late, or the end.

  bool operator==(const HeldBack&) const = default;
};

/// Traffic of one topic with one peer since the start.
struct PeerTraffic {
  std::string topic;
  TrafficCategory category = TrafficCategory::kOther;
  Direction direction = Direction::kOut;
  std::optional<RobotId> peer;  ///< Empty: a reader that is no robot of the team, or all peers.
  TrafficCount count;           ///< Out: once per reader matched when it was written.
  std::uint64_t retransmitted_bytes = 0;  ///< Out only; of a topic to all it has no single peer.
};

/// What happened on one topic in one direction since the start.
struct TopicTraffic {
  std::string topic;
  TrafficCategory category = TrafficCategory::kOther;
  Direction direction = Direction::kOut;
  TrafficCount count;            ///< Out: once per message. In: new messages from known robots.
  std::uint64_t duplicates = 0;  ///< In: arrived before.
  std::uint64_t missing = 0;     ///< In: numbers not arrived (yet), overtaken states included.
  std::uint64_t failures = 0;    ///< Out: refused by DDS.
  HeldBack held = {};            ///< Out.
  std::map<std::string, std::uint64_t> refused;  ///< In: by reason.
};

struct TrafficSnapshot {
  std::vector<PeerTraffic> peers;
  std::vector<TopicTraffic> topics;

  /// Bytes of a category, over all topics and peers; sent ones with their retransmissions.
  [[nodiscard]] std::uint64_t bytes(Direction direction, TrafficCategory category) const;
};

/// Writes traffic.csv: counts over time, a row whenever one has changed. Columns: time_s,
/// direction, topic, category, peer ("*" where it has no single one), messages, bytes,
/// retransmitted_bytes. Directions are in and out, cumulative, and where there is a budget delayed,
/// superseded, dropped, likewise, and waiting, as of then: see HeldBack.
class TrafficCsv {
 public:
  /// Writes the header line, or goes on behind the rows of `former` processes, whose counts are
  /// added. `output` outlives this.
  explicit TrafficCsv(std::ostream& output, std::string_view former = {});
  void append(double time_s, const TrafficSnapshot& snapshot);

 private:
  // Messages, bytes, retransmitted bytes.
  using Counts = std::array<std::uint64_t, 3>;
  // "out,bow_vectors,place_recognition,7": what the counts of a row are of.
  using Subject = std::string;

  void append(double time_s, const std::string& direction, const PeerTraffic& row);

  std::ostream& output_;
  std::map<Subject, Counts> former_, written_;
};

}  // namespace km
