#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "runtime/dds/codec.hpp"
#include "runtime/dds/envelope.hpp"
#include "runtime/dds/fair_queue.hpp"
#include "runtime/dds/incoming_topic.hpp"
#include "runtime/dds/outgoing_topic.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/peers.hpp"
#include "runtime/dds/sender.hpp"
#include "runtime/dds/traffic.hpp"
#include "runtime/guarded_thread.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// A message for one other robot.
template <typename T>
struct Addressed {
  RobotId to = 0;
  std::shared_ptr<const T> message;
  std::uint64_t boot = 0;  ///< See Addressee.
};

/// A channel between robots: a message published on `to_peers` here arrives on `from_peers` there.
/// One end can only be written and the other only read, so that no node confuses them.
template <typename T, typename Sent = T>
class Crossing {
 public:
  [[nodiscard]] Out<Sent> to_peers() { return own_; }
  [[nodiscard]] In<T> from_peers() { return peers_; }

 private:
  friend class DdsBridge;
  Topic<Sent> own_;
  Topic<T> peers_;
};

/// Crossing of messages from one robot to one other.
template <typename T>
using AddressedCrossing = Crossing<T, Addressed<T>>;

/// Selects the ends of a Crossing that this robot uses. If `receive` is false, the other robots do
/// not send the messages of this Crossing to this robot.
struct CrossingEnds {
  bool send = true;
  bool receive = true;
};

/// Rate at which messages of each peer are delivered; further messages wait. For messages that are
/// cheap to send and costly to answer.
struct Pace {
  double per_second = std::numeric_limits<double>::infinity();
  double burst = 1.0;  ///< Number of messages delivered at once after a silence.
};

/// Additional processing of the messages of a crossing. `content` is the sealed part of a message:
/// its serialised form, and its tail.
template <typename T>
struct ContentGuard {
  using Content = std::span<const std::uint8_t>;

  /// Octets that `tail` appends to every message. They are removed before the message is parsed.
  std::size_t tail_bytes = 0;
  std::function<std::vector<std::uint8_t>(const T& message, Content serialized)> tail = {};
  /// Checks each received message before it is published. Returns null, or the reason of a refusal
  /// (a string literal).
  std::function<const char*(const TeamPeer& sender, const T& message, Content content)> check = {};
};

/// Carries topics between robots: in-process Topic<T> <-> DDS topic, through Codec<T>.
///
/// Wire it (exchange) before start(). Messages to peers are encoded and written on the bridge's
/// sending thread. DDS never blocks here because a receiver is missing (all kinds keep the last
/// sample per key). But a slow link can block the socket, and no algorithm should wait for that.
/// The most important messages are written first, and with a budget the others wait for them (see
/// Sender).
/// Received messages are filed on the bridge's receive thread, which waits for nothing else. A
/// thread of each topic publishes them, in rotation between the peers (see IncomingTopic). So a
/// busy node delays only its own messages, and a peer that sends much delays only itself.
///
/// In a team with keys (DdsParticipant::seal()), all messages are sealed, and only robots of the
/// team are received.
///
/// When the network interface or its address changes, the receive thread makes all DDS entities
/// again (see DdsParticipant). The messages that DDS keeps for late readers are written again.
/// Received messages are not lost, because the other robots send to the new readers again.
///
/// The bridge is the last of the nodes to stop. It then sends the queued messages, with a budget as
/// much as the budget permits in two seconds. It waits equally long until the peers have
/// acknowledged them.
class DdsBridge final : public Node {
 public:
  /// Number of messages that may wait to be encoded; then publishers wait.
  static constexpr std::size_t kSendQueue = Sender::kQueue;

  /// `participant` outlives the bridge. Throws ConfigError if `budget` is out of bounds.
  explicit DdsBridge(DdsParticipant& participant, const BudgetConfig& budget = {});
  ~DdsBridge() override;

  /// Connects `crossing`, which outlives the bridge, to those of the other robots. Each message
  /// goes to all robots or, if the crossing is addressed, to its addressee only. The threads of the
  /// bridge call `guard`.
  template <typename T, typename Sent>
  void exchange(Crossing<T, Sent>& crossing, TopicKind kind, TrafficCategory category,
                CrossingEnds ends = {}, Pace pace = {}, ContentGuard<T> guard = {});

  /// In a team with keys, sends this process's key for messages to all to every present robot. The
  /// bridge also does so when a robot appears, and at intervals. Thread-safe.
  void send_keys();

  /// In a team with keys, removes processes whose certificates are no longer valid, and sends a new
  /// key to the other robots. Call it with each change of TeamSeal::update(). Thread-safe.
  void apply(const MembershipChange& change);

  /// In a team with keys, makes new DDS writers to `robot` and sends the events and states for it
  /// again, because packets of DDS have been forged. Does not wait. Thread-safe.
  void renew(RobotId robot) { sender_.renew(robot); }

  /// Peers of this robot. Precondition: a crossing of kind kStatus is connected, because its
  /// liveliness shows which robots are present.
  [[nodiscard]] Peers& peers() { return peers_; }

  /// Counts since the start. Thread-safe.
  [[nodiscard]] TrafficSnapshot traffic() const;

  /// True while messages wait for the budget. Thread-safe.
  [[nodiscard]] bool holds_back() const { return sender_.holds_back(); }

  std::string_view name() const override { return "dds"; }
  void start() override;
  void stop() noexcept override;
  std::exception_ptr error() const override;
  DurationHistogram timing() const override { return sender_.timing(); }
  std::vector<Heartbeat*> heartbeats() override;

 private:
  OutgoingTopic& add_outgoing(TopicSpec spec);
  void add_incoming(TopicSpec spec, bool addressed, Pace pace, IncomingTopic::Handler handler);
  void receive_keys();
  void send_key(const TeamPeer& peer);
  void catch_up(const PeerEvent& event);
  void attach(dds_entity_t condition, dds_attach_t number);
  void open_waitset();
  void move_to(const NetworkInterface& interface);
  void receive_until_stopped();
  void finish_receiving() noexcept;

  DdsParticipant& participant_;
  Peers peers_;
  std::vector<std::unique_ptr<OutgoingTopic>> outgoing_;  // written by sender_
  std::vector<std::unique_ptr<IncomingTopic>> incoming_;
  const std::unique_ptr<OutgoingTopic> keys_;  // null without keys; used by key_sender_
  double keys_sent_s_ = 0.0;                   // receive thread only
  DdsEntity waitset_;
  DdsEntity stop_request_;  // guard condition
  bool stopped_ = false;
  std::atomic<bool> stopping_ = false;
  Heartbeat receiving_;
  GuardedThread receiver_;
  // Separate from sender_, because the receive thread posts to it and must not wait for room.
  Worker<TeamPeer> key_sender_;
  Sender sender_;  // last members: stop first
};

namespace detail {

template <typename T>
using GuardPtr = std::shared_ptr<const ContentGuard<T>>;

template <typename T>
Outgoing outgoing(OutgoingTopic& topic, const GuardPtr<T>& guard,
                  const std::shared_ptr<const T>& message, std::optional<Addressee> to = {}) {
  const auto encode = [guard, message] {
    const auto encoded = Codec<T>::encode(*message);
    auto content = serialize(Codec<T>::descriptor(), &encoded.wire);
    if (guard->tail_bytes == 0) return content;
    const auto tail = guard->tail(*message, content);
    content.insert(content.end(), tail.begin(), tail.end());
    return content;
  };
  return {.topic = &topic, .to = to, .key = Codec<T>::key_of(*message), .encode = encode};
}

template <typename T>
Outgoing outgoing(OutgoingTopic& topic, const GuardPtr<T>& guard,
                  const std::shared_ptr<const Addressed<T>>& message) {
  return outgoing(topic, guard, message->message, Addressee{message->to, message->boot});
}

// Publishes the message in `content`, or returns the reason of a refusal.
template <typename T>
const char* publish_decoded(const Out<T>& to, const TeamPeer& sender,
                            std::span<const std::uint8_t> content, std::shared_ptr<void> token,
                            const ContentGuard<T>& guard = {}) {
  struct Delivery {
    T message;
    std::shared_ptr<void> token;
  };
  WireSample sample(Codec<T>::descriptor());
  if (content.size() < guard.tail_bytes) return "shorter than its tail";
  if (!sample.read(content.first(content.size() - guard.tail_bytes))) return "not deserializable";
  using Wire = typename Codec<T>::Wire;
  Decoded<T> decoded = Codec<T>::decode(*static_cast<const Wire*>(sample.get()), sender);
  if (!decoded.value) return decoded.refusal;
  if (guard.check) {
    if (const char* refusal = guard.check(sender, *decoded.value, content)) return refusal;
  }
  const auto delivery =
      std::make_shared<const Delivery>(std::move(*decoded.value), std::move(token));
  to.publish(std::shared_ptr<const T>(delivery, &delivery->message));
  return nullptr;
}

}  // namespace detail

template <typename T, typename Sent>
void DdsBridge::exchange(Crossing<T, Sent>& crossing, TopicKind kind, TrafficCategory category,
                         CrossingEnds ends, Pace pace, ContentGuard<T> guard) {
  const TopicSpec spec{Codec<T>::kTopic, Codec<T>::kVersion, Codec<T>::kMaxBytes + guard.tail_bytes,
                       kind, category};
  const auto shared = std::make_shared<const ContentGuard<T>>(std::move(guard));
  if (ends.send) {
    OutgoingTopic& topic = add_outgoing(spec);
    crossing.own_.subscribe([this, &topic, shared](const std::shared_ptr<const Sent>& message) {
      sender_.post(detail::outgoing(topic, shared, message));
    });
  }
  if (!ends.receive) return;
  constexpr bool kAddressed = !std::is_same_v<T, Sent>;
  add_incoming(
      spec, kAddressed, pace,
      [to = Out<T>(crossing.peers_), shared](const TeamPeer& sender, auto content, auto token) {
        return detail::publish_decoded(to, sender, content, std::move(token), *shared);
      });
}

}  // namespace km
