#pragma once

#include <dds/ddsc/dds_statistics.h>
#include <envelope.h>

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
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

/// DDS partition in which the messages to one robot travel. In clear, those for all processes of
/// its life: what was kept for a former life does not reach the next. Sealed, those for this
/// process, since no other can open them.
[[nodiscard]] std::string partition_of(const TeamPeer& peer, bool is_sealed);
/// Likewise, of what is sealed for one process by itself.
[[nodiscard]] std::string partition_of(RobotId robot);

/// The sending end of a topic. Messages to all robots go through one writer; each robot addressed
/// gets a writer of its own, in its own partition, so that nobody else is sent its bytes.
///
/// What a robot is sent reaches a process that resumes its life, too. Where the team has keys, that
/// is not what DDS keeps, sealed as it is for the former process: events and states for one robot
/// are kept here in clear as well, and sealed anew for the next one.
///
/// write(), catch_up(), notice_readers(), take_newcomers(), readers_of() and wait_for_acks() belong
/// to one thread; the rest is thread-safe.
class OutgoingTopic {
 public:
  OutgoingTopic(const DdsParticipant& participant, const Peers& peers, TopicSpec spec);

  /// Writes to a robot or to all, sealed where the team has keys. Messages are numbered per writer.
  /// What DDS refuses is counted and logged, as is content that no reader would take. What is for a
  /// robot that has never been there, or for a life that is over, is dropped. For a robot that has
  /// shown no keys events and states wait, and the rest is dropped, counted and logged.
  void write(std::optional<Addressee> addressee, MessageKey key, Octets content);

  /// The robot is there, perhaps as another process: it gets what waits for it, and what its life
  /// was sent before.
  void catch_up(RobotId robot);

  /// Robots that a message written now goes to. An addressee counts before its reader is matched.
  [[nodiscard]] std::vector<RobotId> readers_of(std::optional<Addressee> addressee);

  [[nodiscard]] const TopicSpec& spec() const { return spec_; }

  /// Counts what DDS sends by itself to robots that have come since: all that it keeps for them.
  void notice_readers();

  /// Whether such have been noticed since the last call, by whatever was done here.
  [[nodiscard]] bool take_newcomers() { return std::exchange(newcomers_, false); }

  /// So far: once per reader, and what was sent again.
  [[nodiscard]] std::uint64_t sent_bytes() const;

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
    std::optional<TeamPeer> receiver;  // none: all
    std::string partition;
    std::map<std::string, std::uint32_t> next_number;  // by partition: a process may return
    std::vector<Guid> readers;                         // participants of those matched
    std::map<MessageKey, Octets> kept;                 // to be sealed for the next process
    std::set<MessageKey> due;                          // of these, to this one
    TrafficCount written;
    TrafficCount history;                        // what DDS sends to a reader that comes
    std::map<MessageKey, std::uint64_t> newest;  // bytes of a state in it
    std::uint64_t failures = 0;
    std::map<Guid, TrafficCount> sent_to;
  };

  [[nodiscard]] bool is_sealed() const;
  [[nodiscard]] bool is_kept() const;
  [[nodiscard]] std::optional<TeamPeer> receiver_of(const Addressee& addressee) const;
  [[nodiscard]] std::string partition_for(const std::optional<TeamPeer>& receiver) const;
  Writer& writer_to(const std::optional<TeamPeer>& receiver);
  void send_due(Writer& writer);
  void send(Writer& writer, MessageKey key, Octets content);
  const char* seal(const Writer& writer, const km_wire_Envelope& head, Octets& content) const;
  void refresh_readers(Writer& writer);
  void add_to_history(Writer& writer, MessageKey key, std::uint64_t bytes) const;
  static std::uint64_t retransmitted_bytes(const Writer& writer);

  const DdsParticipant& participant_;
  const Peers& peers_;
  TopicSpec spec_;
  DdsEntity topic_;
  bool newcomers_ = false;
  mutable std::mutex mutex_;  // guards the map and all counts; never held while writing
  std::map<std::optional<RobotId>, Writer> writers_;
};

}  // namespace km
