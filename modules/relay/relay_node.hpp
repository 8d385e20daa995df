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

/// Channels of the relay; they must outlive it.
struct RelayTopics {
  In<PeerEvent> peer_events;  ///< Who is heard directly.
  In<RobotStatus> statuses;   ///< Of those.
  Out<Addressed<RelayParcel>> own_parcels;
  Out<PeerEvent> reached;  ///< kReturned, of robots that are not heard: ways lead there now.
};

/// What nodes tell single robots, and hear of them.
template <typename T>
struct RelayedTopics {
  In<Addressed<T>> own;      ///< From the nodes.
  Out<Addressed<T>> direct;  ///< To the bridge, as they are.
  In<T> heard;               ///< From the bridge.
  Out<T> all;                ///< To the nodes: heard or handed on.
};

/// Stands between the nodes and the bridge on topics whose messages are to reach also robots that
/// this one does not hear: what nodes tell goes to the bridge or to a RelayStore, and what arrives
/// over either comes out of one topic. That a robot is there, or has restarted, as others tell it,
/// comes from Peers like what is heard.
///
/// It has no thread: it works on those that publish to it, and publishes on them what that leads
/// to, so that no node ever waits for another one through it. Thread-safe.
class RelayNode {
 public:
  /// `seal` is null without keys. It, `peers` and the topics outlive this. `now_s` as for
  /// RelayStore, called by any thread.
  RelayNode(TeamPeer self, SharedSeal* seal, Peers& peers, const RelayTopics& topics,
            std::function<double()> now_s = steady_now_s);
  RelayNode(const RelayNode&) = delete;
  RelayNode& operator=(const RelayNode&) = delete;

  // Wiring, before anything is started. `number_of` tells by what a message is asked for; nullopt:
  // it is of no use to others.

  /// What each robot tells all: see RelayKind::kBag.
  template <typename T>
  void join_bags(In<T> heard, Out<T> to);
  /// Closures or inlier sets. Those that replace each other have one Codec<T>::key_of().
  template <typename T>
  void join_letters(RelayKind kind, const RelayedTopics<T>& topics);
  /// Requests or replies.
  template <typename T, typename NumberOf>
  void join_calls(RelayKind kind, const RelayedTopics<T>& topics, const NumberOf& number_of);

  // For the bridge, of crossings whose messages others may hand on: with keys each is signed for
  // that as well, and only who has signed is heard. Who hears a message keeps it.

  /// Of a crossing of bags or of replies.
  template <typename T, typename NumberOf>
  [[nodiscard]] ContentGuard<T> guard(RelayKind kind, const NumberOf& number_of);
  /// Of the crossing of the relay itself: its messages are read here.
  [[nodiscard]] ContentGuard<RelayParcel> guard_parcels();

  /// For the status.
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
  // Lets the store work, then does what it wants done.
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
  [[nodiscard]] const char* take(const RelayParcel& parcel);
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
  mutable std::mutex mutex_;  // guards what follows; never held while publishing
  RelayStore store_;
};

template <typename T>
void RelayNode::join_bags(In<T> heard, Out<T> to) {
  deliver_as<T>(RelayKind::kBag, to);
  heard.subscribe([to](const auto& message) { to.publish(message); });
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
void RelayNode::join_letters(RelayKind kind, const RelayedTopics<T>& topics) {
  deliver_as<T>(kind, topics.all);
  topics.heard.subscribe([to = topics.all](const auto& message) { to.publish(message); });
  topics.own.subscribe([this, kind, direct = topics.direct](const auto& letter) {
    direct.publish(letter);
    const T& message = *letter->message;
    act([&](RelayStore& store) {
      store.wrote(kind, {letter->to, letter->boot}, Codec<T>::key_of(message), bytes_of(message),
                  now_s_());
    });
  });
}

template <typename T, typename NumberOf>
void RelayNode::join_calls(RelayKind kind, const RelayedTopics<T>& topics,
                           const NumberOf& number_of) {
  deliver_as<T>(kind, topics.all);
  topics.heard.subscribe([to = topics.all](const auto& message) { to.publish(message); });
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
