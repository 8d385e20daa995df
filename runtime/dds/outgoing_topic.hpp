#pragma once

#include <dds/ddsc/dds_statistics.h>
#include <envelope.h>

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "runtime/dds/codec.hpp"
#include "runtime/dds/entity.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/peers.hpp"
#include "runtime/dds/qos.hpp"
#include "runtime/dds/traffic.hpp"

namespace km {

/// A topic between robots: what travels on it are envelopes (idl/envelope.idl).
struct TopicSpec {
  std::string name;
  std::uint16_t version = 1;  ///< Of the content's type.
  std::size_t max_bytes = 0;  ///< Of the content.
  TopicKind kind = TopicKind::kEvent;
  TrafficCategory category = TrafficCategory::kOther;
  bool carries_keys = false;  ///< Its messages are sealed by themselves.
};

/// Whom a message is for.
struct Addressee {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Only for the life of this process; 0: whichever it lives.
};

/// DDS partition in which the messages to one robot travel, in the life of this process: what was
/// kept for a former life does not reach the next.
[[nodiscard]] std::string partition_of(const TeamPeer& peer);
/// Likewise, of what is sealed for one process by itself.
[[nodiscard]] std::string partition_of(RobotId robot);

/// The sending end of a topic. Messages to all robots go through one writer; each robot addressed
/// gets a writer of its own, in its own partition, so that nobody else is sent its bytes.
/// write() belongs to one thread; add_to() is thread-safe.
class OutgoingTopic {
 public:
  OutgoingTopic(const DdsParticipant& participant, const Peers& peers, TopicSpec spec);

  /// Writes to a robot or to all, sealed where the team has keys. Messages are numbered per writer.
  /// What DDS refuses is counted and logged, as is content that no reader would take and what is
  /// for a robot that has shown no keys. What is for a robot that has never been there, or for a
  /// life that is over, is dropped.
  void write(std::optional<Addressee> addressee, MessageKey key, std::vector<std::uint8_t> content);

  /// Waits until every matched reader has everything. False on timeout.
  bool wait_for_acks(std::chrono::nanoseconds timeout);

  void add_to(TrafficSnapshot& snapshot) const;

 private:
  struct StatisticsDeleter {
    void operator()(dds_statistics* statistics) const { dds_delete_statistics(statistics); }
  };
  struct Writer {
    DdsEntity publisher;
    DdsEntity writer;
    std::unique_ptr<dds_statistics, StatisticsDeleter> statistics;
    std::string partition;
    std::uint32_t next_number = 0;
    std::vector<Guid> readers;  // participants of those matched
    TrafficCount written;
    std::uint64_t failures = 0;
    std::map<Guid, TrafficCount> sent_to;
  };

  [[nodiscard]] std::optional<std::string> partition_for(std::optional<Addressee> to) const;
  Writer& writer_to(std::optional<RobotId> to, const std::string& partition);
  const char* seal(std::optional<RobotId> to, const km_wire_Envelope& head,
                   std::vector<std::uint8_t>& content) const;
  static void refresh_readers(Writer& writer);
  static std::uint64_t retransmitted_bytes(const Writer& writer);

  const DdsParticipant& participant_;
  const Peers& peers_;
  TopicSpec spec_;
  DdsEntity topic_;
  mutable std::mutex mutex_;  // guards the map and all counts; never held while writing
  std::map<std::optional<RobotId>, Writer> writers_;
};

}  // namespace km
