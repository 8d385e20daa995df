#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "runtime/dds/codec.hpp"
#include "runtime/dds/incoming_topic.hpp"
#include "runtime/dds/outgoing_topic.hpp"
#include "runtime/dds/participant.hpp"
#include "runtime/dds/peers.hpp"
#include "runtime/dds/traffic.hpp"
#include "runtime/node.hpp"
#include "runtime/topic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// A message for one other robot alone.
template <typename T>
struct Addressed {
  RobotId to = 0;
  std::shared_ptr<const T> message;
};

/// Carries topics between robots: in-process Topic<T> <-> DDS topic, through Codec<T>.
///
/// Wire it (send, receive) before start(). What is published on a sent topic is encoded and
/// written on the bridge's sending thread: DDS never blocks here for want of a receiver (all kinds
/// keep the last sample per key), but a thin link can hold up the socket, and no algorithm should
/// wait for that. What is received is published on the bridge's receive thread, one for all
/// topics. A topic that is received must not be the one that is sent: messages would echo.
///
/// The bridge is the last of the nodes to stop: it then sends what is queued, and waits up to two
/// seconds until the peers have acknowledged it.
class DdsBridge final : public Node {
 public:
  /// `participant` outlives the bridge.
  explicit DdsBridge(const DdsParticipant& participant);
  ~DdsBridge() override;

  /// Sends what is published on `from` to all robots.
  template <typename T>
  void send(Topic<T>& from, TopicKind kind, TrafficCategory category);

  /// Sends what is published on `from` to the robot it is addressed to, and to no other.
  template <typename T>
  void send(Topic<Addressed<T>>& from, TopicKind kind, TrafficCategory category);

  /// Publishes on `to` what other robots send to all.
  template <typename T>
  void receive(const Topic<T>& to, TopicKind kind, TrafficCategory category);

  /// Publishes on `to` what other robots send to this one alone.
  template <typename T>
  void receive_addressed(const Topic<T>& to, TopicKind kind, TrafficCategory category);

  /// Needs a received topic of kind kStatus: presence is its liveliness.
  [[nodiscard]] Peers& peers() { return peers_; }

  /// Counts since the start. Thread-safe.
  [[nodiscard]] TrafficSnapshot traffic() const;

  std::string_view name() const override { return "dds"; }
  void start() override;
  void stop() noexcept override;
  std::exception_ptr error() const override;
  DurationHistogram timing() const override { return sender_.timing(); }

 private:
  using Job = std::function<void()>;

  OutgoingTopic& add_outgoing(TopicSpec spec);
  void add_incoming(TopicSpec spec, bool addressed, IncomingTopic::HeaderOf header_of,
                    IncomingTopic::Handler handler);
  template <typename T>
  void add_incoming(const Topic<T>& to, TopicKind kind, TrafficCategory category, bool addressed);
  void post(Job job) { sender_.post(std::move(job)); }
  void receive_until_stopped();
  void await_acknowledgements() noexcept;

  const DdsParticipant& participant_;
  Peers peers_;
  std::vector<std::unique_ptr<OutgoingTopic>> outgoing_;
  std::vector<std::unique_ptr<IncomingTopic>> incoming_;
  DdsEntity waitset_;
  DdsEntity stop_request_;  // guard condition
  bool stopped_ = false;
  std::exception_ptr receive_error_;
  std::atomic<bool> receive_failed_ = false;
  std::thread receiver_;
  Worker<Job> sender_;  // last member: stops first
};

namespace detail {

template <typename T>
void write_encoded(OutgoingTopic& topic, std::optional<RobotId> to, const T& message) {
  auto encoded = Codec<T>::encode(message);
  encoded.wire.header.version = Codec<T>::kVersion;
  topic.write(to, encoded.wire.header, &encoded.wire);
}

}  // namespace detail

template <typename T>
void DdsBridge::send(Topic<T>& from, TopicKind kind, TrafficCategory category) {
  OutgoingTopic& topic = add_outgoing({Codec<T>::kTopic, &Codec<T>::descriptor(), kind, category});
  from.subscribe([this, &topic](const std::shared_ptr<const T>& message) {
    post([&topic, message] { detail::write_encoded<T>(topic, std::nullopt, *message); });
  });
}

template <typename T>
void DdsBridge::send(Topic<Addressed<T>>& from, TopicKind kind, TrafficCategory category) {
  OutgoingTopic& topic = add_outgoing({Codec<T>::kTopic, &Codec<T>::descriptor(), kind, category});
  from.subscribe([this, &topic](const std::shared_ptr<const Addressed<T>>& message) {
    post([&topic, message] { detail::write_encoded<T>(topic, message->to, *message->message); });
  });
}

template <typename T>
void DdsBridge::receive(const Topic<T>& to, TopicKind kind, TrafficCategory category) {
  add_incoming<T>(to, kind, category, false);
}

template <typename T>
void DdsBridge::receive_addressed(const Topic<T>& to, TopicKind kind, TrafficCategory category) {
  add_incoming<T>(to, kind, category, true);
}

template <typename T>
void DdsBridge::add_incoming(const Topic<T>& to, TopicKind kind, TrafficCategory category,
                             bool addressed) {
  using Wire = typename Codec<T>::Wire;
  const auto header_of = [](const void* wire) -> const km_wire_Header& {
    return static_cast<const Wire*>(wire)->header;
  };
  const auto handler = [&to](const void* wire) -> const char* {
    Decoded<T> decoded = Codec<T>::decode(*static_cast<const Wire*>(wire));
    if (!decoded.value) return decoded.refusal;
    to.publish(std::move(*decoded.value));
    return nullptr;
  };
  add_incoming({Codec<T>::kTopic, &Codec<T>::descriptor(), kind, category}, addressed, header_of,
               handler);
}

}  // namespace km
