#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "modules/core/data/team_links.hpp"
#include "runtime/clock.hpp"
#include "runtime/dds/bridge.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/dds/shared_seal.hpp"
#include "runtime/node.hpp"
#include "runtime/overlay/overlay.hpp"
#include "runtime/overlay/overlay_codec.hpp"
#include "runtime/periodic.hpp"
#include "runtime/topic.hpp"

namespace km {

using TeamLanePacket = LanePacket<OverlayLane::kTeam>;
using PlacesLanePacket = LanePacket<OverlayLane::kPlaces>;

/// Channels of the overlay, which must outlive it.
struct OverlayTopics {
  In<PeerEvent> peer_events;  ///< Robots that this robot receives directly.
  In<RobotStatus> statuses;   ///< Statuses of these robots.
  Out<Addressed<TeamLanePacket>> team_packets;
  Out<Addressed<PlacesLanePacket>> places_packets;
  Out<PeerEvent> reached;  ///< kReturned for a robot that is not received directly, when a route to
                           ///< it appears.
  Out<LinksReport> links;  ///< When they have changed, at the next tick.
  std::function<void(RobotId)> renew = [](RobotId) {};  ///< See DdsBridge::renew().
};

/// Channels of one message type that nodes address to single robots.
template <typename T>
struct RelayedTopics {
  In<Addressed<T>> own;      ///< Messages from the nodes of this robot.
  Out<Addressed<T>> direct;  ///< The same messages, unchanged, to the bridge.
  In<T> received;            ///< Messages from the bridge.
  Out<T> all;                ///< Direct and forwarded messages, to the nodes.
};

/// Connects nodes and bridge to an Overlay. Robots in range exchange the messages of some topics
/// directly: on these it passes messages of the nodes to the bridge or to the overlay. Both kinds
/// of received message arrive on one topic. States and messages of solvers use the overlay alone.
/// When neighbours report a new or restarted robot, Peers announces that robot like one that is
/// received directly.
///
/// Works on the threads that publish to it and publishes the results on them, so that no node waits
/// for another node. Its own thread only marks the passage of time. Thread-safe.
class OverlayNode final : public Node {
 public:
  /// `seal` is null in a team without keys. `seal`, `peers` and the topics outlive this object. Any
  /// thread may call `now_s`, which has the same meaning as in Overlay.
  OverlayNode(TeamPeer self, SharedSeal* seal, Peers& peers, const OverlayTopics& topics,
              std::function<double()> now_s = steady_now_s);
  ~OverlayNode() override { stop(); }

  std::string_view name() const override { return "overlay"; }
  void start() override { ticks_.start(); }
  void stop() noexcept override { ticks_.stop(); }
  std::exception_ptr error() const override { return ticks_.error(); }

  // Wiring, to be called before any node starts. `number_of` returns the number by which a robot
  // requests this message, or nullopt if the message is of no use to other robots.

  /// Receiver of the messages of a stream. It returns null, or the reason of a refusal (a string
  /// literal).
  using Reader = std::function<const char*(const OverlayMessage& message)>;
  void read(OverlayStream stream, Reader reader) { readers_[stream] = std::move(reader); }

  /// Publishes the messages of the bridge and those of a stream on one topic: alone for bags of
  /// words, which each robot sends to all others.
  template <typename T>
  void join(OverlayStream stream, In<T> received, Out<T> to);
  /// Connects the topics of closures or of inlier sets. Messages with equal Codec<T>::key_of()
  /// replace each other.
  template <typename T>
  void join_reliable(OverlayStream stream, const RelayedTopics<T>& topics);
  /// Connects the topics of requests or of replies.
  template <typename T, typename NumberOf>
  void join_calls(OverlayStream stream, const RelayedTopics<T>& topics, const NumberOf& number_of);

  // Guards for the bridge, on topics whose messages other robots may forward. In a team with keys
  // each message carries a second signature for forwarding, and the bridge refuses messages without
  // it. Each receiver stores the message.

  /// Guard of the topic of bags or of replies: signs and checks messages, and stores received ones.
  template <typename T, typename NumberOf>
  [[nodiscard]] ContentGuard<T> guard(OverlayStream stream, const NumberOf& number_of);
  /// Guard of a topic of packets: processes each received one.
  template <OverlayLane kLane>
  [[nodiscard]] ContentGuard<LanePacket<kLane>> guard_packets() {
    return {.check = [this](const TeamPeer& sender, const auto& packet, auto /*content*/) {
      return this->take(sender, packet);
    }};
  }

  // See Overlay.
  void publish(OverlayStream stream, std::vector<std::uint8_t> content);
  void call(OverlayStream stream, RobotId to, std::uint32_t number,
            std::vector<std::uint8_t> content);
  void step();

  /// Summary that this robot publishes in its status.
  [[nodiscard]] OverlaySummary summary() const;
  /// Bytes sent for sessions, counted per receiver and with forwarded messages.
  [[nodiscard]] std::uint64_t session_bytes() const { return session_bytes_; }

 private:
  template <typename T>
  static std::vector<std::uint8_t> bytes_of(const T& message) {
    const auto encoded = Codec<T>::encode(message);
    return serialize(Codec<T>::descriptor(), &encoded.wire);
  }
  // Runs `work` on the overlay and then carries out its output.
  template <typename Work>
  void act(const Work& work) {
    OverlayOutput output;
    std::uint64_t given_up = 0;
    {
      const std::lock_guard lock(mutex_);
      work(overlay_);
      output = overlay_.take_output();
      given_up = overlay_.given_up();
    }
    carry_out(output, given_up);
  }
  void carry_out(const OverlayOutput& output, std::uint64_t given_up);
  void send(const OverlayPacket& packet);
  void deliver(const OverlayMessage& message) const;
  void take(const PeerEvent& event);
  [[nodiscard]] const char* take(const TeamPeer& sender, const OverlayPacket& packet);
  [[nodiscard]] const char* keep(OverlayStream stream, const TeamPeer& sender, std::uint32_t number,
                                 std::span<const std::uint8_t> content);
  [[nodiscard]] std::vector<std::uint8_t> signature_of(OverlayStream stream, std::uint32_t number,
                                                       std::span<const std::uint8_t> content) const;
  [[nodiscard]] std::optional<RobotIdentity> identity_of(const TeamPeer& robot) const;
  [[nodiscard]] OverlayWays ways_to(RobotId robot) const;

  const TeamPeer self_;
  const std::optional<OverlayKeys> keys_;
  Peers& peers_;
  const OverlayTopics topics_;
  const std::function<double()> now_s_;
  std::map<OverlayStream, Reader> readers_;
  std::atomic<std::uint64_t> session_bytes_ = 0;
  mutable std::mutex mutex_;  // Guards the members below; never held while publishing.
  Overlay overlay_;
  std::uint64_t links_version_ = 0;
  Periodic ticks_;  // last member: stops first
};

template <typename T>
void OverlayNode::join(OverlayStream stream, In<T> received, Out<T> to) {
  read(stream, [to](const OverlayMessage& message) {
    return detail::publish_decoded(to, message.origin, message.content, nullptr);
  });
  received.subscribe([to](const auto& message) { to.publish(message); });
}

template <typename T, typename NumberOf>
ContentGuard<T> OverlayNode::guard(OverlayStream stream, const NumberOf& number_of) {
  const auto check = [this, stream, number_of](const TeamPeer& sender, const T& message,
                                               auto content) -> const char* {
    const std::optional<KeyframeId> keyframe = number_of(message);
    return keyframe ? keep(stream, sender, keyframe->index, content) : nullptr;
  };
  if (!keys_) return {.check = check};
  const auto tail = [this, stream, number_of](const T& message, auto serialized) {
    const std::optional<KeyframeId> keyframe = number_of(message);
    return signature_of(stream, keyframe ? keyframe->index : 0, serialized);
  };
  return {.tail_bytes = kEndorsementBytes, .tail = tail, .check = check};
}

template <typename T>
void OverlayNode::join_reliable(OverlayStream stream, const RelayedTopics<T>& topics) {
  join(stream, topics.received, topics.all);
  topics.own.subscribe([this, stream, direct = topics.direct](const auto& addressed) {
    direct.publish(addressed);
    const T& message = *addressed->message;
    act([&](Overlay& overlay) {
      overlay.wrote(stream, {addressed->to, addressed->boot}, Codec<T>::key_of(message),
                    bytes_of(message), now_s_());
    });
  });
}

template <typename T, typename NumberOf>
void OverlayNode::join_calls(OverlayStream stream, const RelayedTopics<T>& topics,
                             const NumberOf& number_of) {
  join(stream, topics.received, topics.all);
  topics.own.subscribe([this, stream, direct = topics.direct, number_of](const auto& addressed) {
    const std::optional<KeyframeId> keyframe = number_of(*addressed->message);
    const OverlayWays ways = ways_to(addressed->to);
    if (ways.direct) direct.publish(addressed);
    if (ways.relay && keyframe)
      call(stream, addressed->to, keyframe->index, bytes_of(*addressed->message));
  });
}

}  // namespace km
