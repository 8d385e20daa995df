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

/// A topic between robots, which carries envelopes (idl/envelope.idl).
struct TopicSpec {
  std::string name;
  std::uint16_t version = 1;  ///< Version of the content's type.
  std::size_t max_bytes = 0;  ///< Maximum size of the content.
  TopicKind kind = TopicKind::kEvent;
  TrafficCategory category = TrafficCategory::kOther;
  bool carries_keys = false;  ///< Messages of this topic are sealed separately.
};

/// Keys of the messages in the status topic by which a robot announces itself: they are not sealed,
/// and their content is the USER_DATA of its participant. See Peers::take_announcement_due().
inline constexpr MessageKey kAnnouncement = 1, kAskingAnnouncement = 2;
[[nodiscard]] constexpr bool is_announcement(TopicKind kind, MessageKey key) {
  return kind == TopicKind::kStatus && (key == kAnnouncement || key == kAskingAnnouncement);
}

/// Receiver of a message.
struct Addressee {
  RobotId robot = 0;
  std::uint64_t boot = 0;  ///< Only for the incarnation of this process; 0: for any.
};

/// DDS partition of the messages to one robot. Without a seal it contains all processes of one
/// incarnation, so messages for a former incarnation do not reach the next. With a seal it contains
/// only this process, because no other can open the messages.
[[nodiscard]] std::string partition_of(const TeamPeer& peer, bool is_sealed);
/// DDS partition of messages that are sealed individually for one process.
[[nodiscard]] std::string partition_of(RobotId robot);

/// The sending end of a topic. Messages to all robots use one writer. Each addressee has a writer
/// of its own, in its own partition, so that other robots do not receive its bytes.
///
/// A resumed process also receives the messages that were sent to its robot before. In a team with
/// keys, DDS cannot keep them, because they are sealed for the former process. So events and states
/// for one robot are also kept here without a seal, and sealed again for the next process. Events
/// for all robots are kept, too, for renew().
///
/// add_to(), sent_bytes() and spec() are thread-safe; all other functions belong to one thread. All
/// threads hold DdsParticipant::use().
class OutgoingTopic {
 public:
  OutgoingTopic(const DdsParticipant& participant, Peers& peers, TopicSpec spec);

  /// Writes to a robot or to all, sealed where the team has keys. Messages are numbered per writer.
  /// Content that DDS refuses, or that no reader would accept, is counted and logged. Messages for
  /// a robot that was never present, or for an earlier incarnation, are dropped. For a robot
  /// without known keys, events and states wait; other messages are dropped, counted and logged.
  void write(std::optional<Addressee> addressee, MessageKey key, Octets content);

  /// In a team with keys, sends the kept messages that the present process of `robot` does not
  /// have. Call when it appears.
  void catch_up(RobotId robot);

  /// In a team with keys, renews the writer to `robot` and, for events, the writer to all, and
  /// sends the kept messages again. Readers that forged packets of DDS have made ignore a writer do
  /// not ignore its successor.
  void renew(RobotId robot);
  /// Copies the messages that DDS keeps for late readers, before DdsParticipant::move_to().
  /// `reader` is another participant in the domain.
  void save(dds_entity_t reader);
  /// Creates the DDS entities, again after move_to(). Then it writes the copied messages, with
  /// their numbers, so that robots that have received them drop them.
  void open();

  /// True if no message to `robot` alone waits for its acknowledgement.
  [[nodiscard]] bool is_acknowledged_by(RobotId robot) const;

  /// Robots that would receive a message written now. An addressee counts before its reader is
  /// matched.
  [[nodiscard]] std::vector<RobotId> readers_of(std::optional<Addressee> addressee);

  [[nodiscard]] const TopicSpec& spec() const { return spec_; }

  /// Counts the stored messages that DDS has sent to new readers by itself.
  void notice_readers();

  /// True if any member function has noticed such readers since the last call.
  [[nodiscard]] bool take_newcomers() { return std::exchange(newcomers_, false); }

  /// Bytes sent so far, counted once per reader and retransmission.
  [[nodiscard]] std::uint64_t sent_bytes() const;

  /// Waits until every matched reader has acknowledged all messages. False on timeout.
  bool wait_for_acks(std::chrono::nanoseconds timeout);

  void add_to(TrafficSnapshot& snapshot) const;

 private:
  struct StatisticsDeleter {
    void operator()(dds_statistics* statistics) const { dds_delete_statistics(statistics); }
  };
  struct Saved {
    km_wire_Envelope head{};
    Octets content;
  };
  struct Writer {
    DdsEntity publisher;
    DdsEntity writer;
    std::unique_ptr<dds_statistics, StatisticsDeleter> statistics;
    std::optional<TeamPeer> receiver;  // empty: all robots
    std::string partition;
    std::vector<Saved> saved;                          // between save() and open()
    std::map<std::string, std::uint32_t> next_number;  // by partition, because a process may return
    std::vector<Guid> readers;                         // participants of the matched readers
    std::map<MessageKey, Octets> kept;                 // messages to be sealed for the next process
    std::set<MessageKey> due;                          // messages in `kept` that the process lacks
    TrafficCount written;
    TrafficCount history;                        // messages that DDS sends to a new reader
    std::map<MessageKey, std::uint64_t> newest;  // bytes of each state in `history`
    std::map<Guid, TrafficCount> sent_to;
  };

  [[nodiscard]] bool is_sealed() const;
  [[nodiscard]] bool is_kept() const;
  [[nodiscard]] std::optional<TeamPeer> receiver_of(const Addressee& addressee) const;
  [[nodiscard]] std::string partition_for(const std::optional<TeamPeer>& receiver) const;
  Writer& writer_to(const std::optional<TeamPeer>& receiver);
  void open(Writer& writer, const std::optional<TeamPeer>& receiver);
  void renew(const std::optional<TeamPeer>& receiver);
  [[nodiscard]] std::vector<Saved> saved(dds_entity_t reader, const Writer& writer) const;
  void send_due(Writer& writer);
  void announce(Writer& writer);
  void send(Writer& writer, MessageKey key, Octets content);
  const char* seal(const Writer& writer, const km_wire_Envelope& head, Octets& content) const;
  void refresh_readers(Writer& writer);
  void add_to_history(Writer& writer, MessageKey key, std::uint64_t bytes) const;
  static std::uint64_t retransmitted_bytes(const Writer& writer);

  const DdsParticipant& participant_;
  Peers& peers_;
  TopicSpec spec_;
  DdsEntity topic_;
  bool newcomers_ = false;
  mutable std::mutex mutex_;  // guards the map and all counts; never held while writing
  std::map<std::optional<RobotId>, Writer> writers_;
  std::map<std::string, std::uint64_t> not_written_;  // messages by reason
};

}  // namespace km
