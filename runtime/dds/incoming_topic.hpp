#pragma once

#include <envelope.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "modules/core/data/pending_messages.hpp"
#include "runtime/dds/fair_queue.hpp"
#include "runtime/dds/outgoing_topic.hpp"
#include "runtime/dds/sequence_tracker.hpp"
#include "runtime/guarded_thread.hpp"
#include "runtime/heartbeat.hpp"

namespace km {

/// Time after which a process sends its key again: a robot that was short of memory may have
/// dropped it [s].
inline constexpr double kKeyPeriod_s = 30.0;

/// Number of messages that subscribers hold. It is bounded, so that the next message waits with
/// those of its peer and not before other peers' messages in a node's queue. Thread-safe.
class InFlight : public std::enable_shared_from_this<InFlight> {
 public:
  /// Waits until there is room, for a bounded time, because one subscriber must not stop the
  /// others. The message counts until the token is released.
  [[nodiscard]] std::shared_ptr<void> enter();

 private:
  void leave();

  std::mutex mutex_;  // guards the members below
  std::condition_variable left_;
  int count_ = 0;
};

/// The receiving end of a topic, in two steps. The gate runs on the receive thread and knows only
/// the writer and the length of a message. It files messages of robots of the team, separately for
/// each robot, lets messages of unknown writers wait for a short time, and refuses all others. It
/// never waits. Delivery runs on the topic's own thread. It reads the filed messages, in rotation
/// between the robots, drops duplicates, and calls the subscribers.
///
/// All received bytes are untrusted. Messages that are refused, or dropped because there is no
/// room, are counted by reason and logged at a limited rate.
class IncomingTopic {
 public:
  /// Receives the content of a message and publishes it, or returns the reason of a refusal (a
  /// string literal). Subscribers hold `token` as long as they process the message.
  using Handler = std::function<const char*(
      const TeamPeer& sender, std::span<const std::uint8_t> content, std::shared_ptr<void> token)>;

  /// `addressed`: accepts only messages to this robot, otherwise only messages to all.
  IncomingTopic(const DdsParticipant& participant, Peers& peers, TopicSpec spec, bool addressed,
                const QueueQuota& quota, Handler handler);
  ~IncomingTopic();

  // The gate, called by the receive thread.

  /// Creates the DDS entities, again after DdsParticipant::move_to().
  void open();

  /// DDS condition that triggers while take() has messages to read.
  [[nodiscard]] dds_entity_t condition() const { return condition_.handle(); }
  /// Files all received messages.
  void take(double now_s);
  /// Files the messages whose writer has become known. Call at intervals.
  void recall(double now_s);

  // Delivery.

  void start();
  /// Drops all filed messages. Idempotent.
  void stop() noexcept;
  [[nodiscard]] std::exception_ptr error() const { return delivery_.error(); }

  [[nodiscard]] Heartbeat& heartbeat() { return delivering_; }

  /// Thread-safe.
  void add_to(TrafficSnapshot& snapshot) const;

 private:
  // Deserialised envelope. It outlives the DDS entities, which may be made again.
  struct EnvelopeDeleter {
    void operator()(km_wire_Envelope* envelope) const {
      dds_sample_free(envelope, &km_wire_Envelope_desc, DDS_FREE_ALL);
    }
  };
  using Received = std::unique_ptr<km_wire_Envelope, EnvelopeDeleter>;
  struct Filed {
    Received envelope;
    TeamPeer sender;
    Guid writer{};
  };
  // Result of opening a message. `content` refers to the envelope or, if that was sealed, to
  // `how.content`.
  struct Readable {
    Opened how;
    std::span<const std::uint8_t> content;
  };
  enum class Verdict { kTaken, kNotYet };

  DdsEntity make_reader();
  void arrive(const ddsi_serdata& serialized, dds_instance_handle_t writer, double now_s);
  void announce(const km_wire_Envelope& envelope, const Guid& writer);
  bool is_settled(Standing standing) const;
  void admit(Received envelope, const Guid& writer, const Peers::Claim& claim, double now_s);
  void file(Received envelope, const TeamPeer& sender, const Guid& writer, double now_s);
  void receive_claim(const km_wire_Envelope& envelope, const Guid& writer,
                     const Peers::Claim& claim, double now_s);
  [[nodiscard]] Readable open(const km_wire_Envelope& envelope, const Guid& writer) const;
  void deliver_until_stopped();
  void await_key(Filed filed, double now_s);
  bool deliver_again(double now_s);
  Verdict deliver(const Filed& filed);
  const char* pass_to_handler(const Filed& filed, std::span<const std::uint8_t> content);
  bool is_new(const TeamPeer& sender, std::uint32_t number);
  void refuse(const char* reason);

  const DdsParticipant& participant_;
  Peers& peers_;
  TopicSpec spec_;
  const bool addressed_;
  Handler handler_;
  WriterBook writers_;
  PendingMessages<Guid, Received> waiting_;  // receive thread only: messages of unknown writers
  PendingMessages<RobotId, Filed> sealed_;   // delivery only: messages whose key is missing
  double started_s_ = 0.0;

  mutable std::mutex mutex_;  // guards the filed messages and the counts
  std::condition_variable filed_changed_;
  FairQueue<Filed> filed_;
  bool stopping_ = false;
  std::map<TeamPeer, SequenceTracker> streams_;
  std::map<RobotId, TrafficCount> from_;
  std::uint64_t duplicates_ = 0;
  std::map<std::string, std::uint64_t> refused_;

  std::shared_ptr<InFlight> in_flight_ = std::make_shared<InFlight>();
  Heartbeat delivering_;
  GuardedThread delivery_;
  DdsEntity topic_;
  DdsEntity subscriber_;
  DdsEntity reader_;
  DdsEntity condition_;
};

}  // namespace km
