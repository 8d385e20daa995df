#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "modules/core/relay_summary.hpp"
#include "modules/relay/relay_codec.hpp"
#include "modules/relay/relay_store.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/bridge.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/dds/shared_seal.hpp"
#include "runtime/topic.hpp"

namespace km {

/// Channels of the relay, which must outlive it.
struct RelayTopics {
  In<PeerEvent> peer_events;  ///< Robots that this robot receives directly.
  In<RobotStatus> statuses;   ///< Statuses of these robots.
  Out<Addressed<RelayPacket>> own_packets;
  Out<PeerEvent> reached;  ///< kReturned for a robot that is not received directly, when a route to
                           ///< it appears.
};

/// Channels of one message type that nodes address to single robots.
template <typename T>
struct RelayedTopics {
  In<Addressed<T>> own;      ///< Messages from the nodes of this robot.
  Out<Addressed<T>> direct;  ///< The same messages, unchanged, to the bridge.
  In<T> received;            ///< Messages from the bridge.
  Out<T> all;                ///< Direct and forwarded messages, to the nodes.
};

/// Connects nodes and bridge on topics whose messages must also reach robots out of range. It
/// passes messages of the nodes to the bridge or to a RelayStore. Both kinds of received message,
/// direct and forwarded, arrive on one topic. When neighbours report a new or restarted robot,
/// Peers announces that robot like one that is received directly.
///
/// Has no thread: it runs on the threads that publish to it and publishes the results on them, so
/// that no node waits for another node. Thread-safe.
class RelayNode {
 public:
  /// `seal` is null in a team without keys. `seal`, `peers` and the topics outlive this object. Any
  /// thread may call `now_s`, which has the same meaning as in RelayStore.
  RelayNode(TeamPeer self, SharedSeal* seal, Peers& peers, const RelayTopics& topics,
            std::function<double()> now_s = steady_now_s);
  RelayNode(const RelayNode&) = delete;
  RelayNode& operator=(const RelayNode&) = delete;

  // Wiring, to be called before any node starts. `number_of` returns the number by which a robot
  // requests this message, or nullopt if the message is of no use to other robots.

  /// Connects the topics of bags of words, which each robot sends to all others: see
  /// RelayKind::kBag.
  template <typename T>
  void join_bags(In<T> received, Out<T> to);
  /// Connects the topics of closures or of inlier sets. Messages with equal Codec<T>::key_of()
  /// replace each other.
  template <typename T>
  void join_reliable(RelayKind kind, const RelayedTopics<T>& topics);
  /// Connects the topics of requests or of replies.
  template <typename T, typename NumberOf>
  void join_calls(RelayKind kind, const RelayedTopics<T>& topics, const NumberOf& number_of);

  // Guards for the bridge, on topics whose messages other robots may forward. In a team with keys
  // each message carries a second signature for forwarding, and the bridge refuses messages without
  // it. Each receiver stores the message.

  /// Guard of the topic of bags or of replies: signs and checks messages, and stores received ones.
  template <typename T, typename NumberOf>
  [[nodiscard]] ContentGuard<T> guard(RelayKind kind, const NumberOf& number_of);
  /// Guard of the relay's own topic: processes each received message.
  [[nodiscard]] ContentGuard<RelayPacket> guard_packets();

  /// Summary that this robot publishes in its status.
  [[nodiscard]] RelaySummary summary() const;

 private:
  template <typename T>
  static std::vector<std::uint8_t> bytes_of(const T& message) {
    const auto encoded = Codec<T>::encode(message);
    return serialize(Codec<T>::descriptor(), &encoded.wire);
  }
  template <typename T>
  void deliver_as(RelayKind kind, Out<T> to) {
    readers_[kind] = [to](const TeamPeer& origin, std::span<const std::uint8_t> content) {
      return detail::publish_decoded(to, origin, content, nullptr);
    };
  }
  // Runs `work` on the store and then carries out the output of the store.
  template <typename Work>
  void act(const Work& work) {
    RelayOutput output;
    std::uint64_t given_up = 0;
    {
      const std::lock_guard lock(mutex_);
      work(store_);
      output = store_.take_output();
      given_up = store_.given_up();
    }
    carry_out(output, given_up);
  }
  void carry_out(const RelayOutput& output, std::uint64_t given_up);
  void deliver(const RelayMessage& message) const;
  void take(const PeerEvent& event);
  [[nodiscard]] const char* take(const RelayPacket& packet);
  [[nodiscard]] const char* keep(RelayKind kind, const TeamPeer& sender, std::uint32_t number,
                                 std::span<const std::uint8_t> content);
  [[nodiscard]] std::vector<std::uint8_t> signature_of(RelayKind kind, std::uint32_t number,
                                                       std::span<const std::uint8_t> content) const;
  [[nodiscard]] std::optional<RobotIdentity> identity_of(const TeamPeer& robot) const;
  [[nodiscard]] RelayWays ways_to(RobotId robot) const;

  const TeamPeer self_;
  const std::optional<RelayKeys> keys_;
  Peers& peers_;
  const RelayTopics topics_;
  const std::function<double()> now_s_;
  std::map<RelayKind, std::function<const char*(const TeamPeer&, std::span<const std::uint8_t>)>>
      readers_;
  mutable std::mutex mutex_;  // Guards the members below; never held while publishing.
  RelayStore store_;
};

template <typename T>
void RelayNode::join_bags(In<T> received, Out<T> to) {
  deliver_as<T>(RelayKind::kBag, to);
  received.subscribe([to](const auto& message) { to.publish(message); });
}

template <typename T, typename NumberOf>
ContentGuard<T> RelayNode::guard(RelayKind kind, const NumberOf& number_of) {
  const auto check = [this, kind, number_of](const TeamPeer& sender, const T& message,
                                             auto content) -> const char* {
    const std::optional<KeyframeId> keyframe = number_of(message);
    return keyframe ? keep(kind, sender, keyframe->index, content) : nullptr;
  };
  if (!keys_) return {.check = check};
  const auto tail = [this, kind, number_of](const T& message, auto serialized) {
    const std::optional<KeyframeId> keyframe = number_of(message);
    return signature_of(kind, keyframe ? keyframe->index : 0, serialized);
  };
  return {.tail_bytes = kEndorsementBytes, .tail = tail, .check = check};
}

template <typename T>
void RelayNode::join_reliable(RelayKind kind, const RelayedTopics<T>& topics) {
  deliver_as<T>(kind, topics.all);
  topics.received.subscribe([to = topics.all](const auto& message) { to.publish(message); });
  topics.own.subscribe([this, kind, direct = topics.direct](const auto& addressed) {
    direct.publish(addressed);
    const T& message = *addressed->message;
    act([&](RelayStore& store) {
      store.wrote(kind, {addressed->to, addressed->boot}, Codec<T>::key_of(message),
                  bytes_of(message), now_s_());
    });
  });
}

template <typename T, typename NumberOf>
void RelayNode::join_calls(RelayKind kind, const RelayedTopics<T>& topics,
                           const NumberOf& number_of) {
  deliver_as<T>(kind, topics.all);
  topics.received.subscribe([to = topics.all](const auto& message) { to.publish(message); });
  topics.own.subscribe([this, kind, direct = topics.direct, number_of](const auto& call) {
    const std::optional<KeyframeId> keyframe = number_of(*call->message);
    const RelayWays ways = ways_to(call->to);
    if (ways.direct) direct.publish(call);
    if (!ways.relay || !keyframe) return;
    act([&](RelayStore& store) {
      store.call(kind, call->to, keyframe->index, bytes_of(*call->message));
    });
  });
}

}  // namespace km
