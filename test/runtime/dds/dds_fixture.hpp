#pragma once

#include "ping.h"
#include "runtime/dds/bridge.hpp"
#include "runtime/dds/codec.hpp"
#include "runtime/dds/qos.hpp"
#include "runtime/dds/robot_status.hpp"
#include "test/support/inbox.hpp"
#include "test/support/loopback_config.hpp"
#include "test/support/patience.hpp"
#include "test/support/test.hpp"

namespace km {

/// A message for tests of the transport: `index` is its key.
struct Ping {
  std::uint16_t robot = 0;
  std::uint32_t index = 0;
  std::vector<std::uint8_t> payload;
};

template <>
struct Codec<Ping> : WireFormat<km_wire_Ping, km_wire_Ping_desc> {
  static constexpr const char* kTopic = "pings";
  static constexpr std::size_t kMaxBytes = 100000;

  struct Encoded {
    Wire wire{};
    std::vector<std::uint8_t> payload;
  };
  static MessageKey key_of(const Ping& ping) { return message_key({ping.index}); }
  static Encoded encode(const Ping& ping) {
    Encoded encoded;
    encoded.payload = ping.payload;
    encoded.wire.index = ping.index;
    borrow(encoded.wire.payload, encoded.payload);
    return encoded;
  }
  /// Refuses payloads that start with 0xFF.
  static Decoded<Ping> decode(const Wire& wire, const TeamPeer& writer) {
    const std::uint8_t* data = wire.payload._buffer;
    const std::uint32_t size = wire.payload._length;
    if (size > 0 && data[0] == 0xFF) return Decoded<Ping>::refuse("payload starts with 0xFF");
    return Decoded<Ping>::accept({writer.robot, wire.index, {data, data + size}});
  }
};

/// Polls until `condition` holds; false if it never does. For counters without notification.
inline bool eventually(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// A participant that announces this user data.
inline DdsEntity participant_with(const DdsConfig& config, const std::string& user_data) {
  const DdsQos qos = make_dds_qos();
  dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  return {dds_create_participant(static_cast<dds_domainid_t>(config.domain), qos.get(), nullptr),
          "participant"};
}

/// Writes whatever envelopes it is given, as a faulty or hostile program may.
class RawWriter {
 public:
  RawWriter(dds_entity_t participant, const DdsConfig& config, TopicKind kind,
            const char* topic = Codec<Ping>::kTopic)
      : topic_(dds_create_topic(participant, &km_wire_Envelope_desc, topic, nullptr, nullptr),
               "topic"),
        writer_(dds_create_writer(participant, topic_.handle(), make_writer_qos(kind, config).get(),
                                  nullptr),
                "writer") {}

  void write_bytes(km_wire_Envelope head, std::vector<std::uint8_t> content) {
    borrow(head.content, content);
    check_dds(dds_write(writer_.handle(), &head), "write");
  }
  void write(km_wire_Envelope head, const Ping& ping) {
    const auto encoded = Codec<Ping>::encode(ping);
    head.key = Codec<Ping>::key_of(ping);
    write_bytes(head, serialize(Codec<Ping>::descriptor(), &encoded.wire));
  }
  /// True when this many readers have matched. Statuses that are written before may be lost to a
  /// reader.
  [[nodiscard]] bool is_read_by(std::uint32_t readers) const {
    return eventually([&] {
      dds_publication_matched_status_t status{};
      dds_get_publication_matched_status(writer_.handle(), &status);
      return status.current_count >= readers;
    });
  }
  /// True once all of its readers have acknowledged everything; not of a status.
  [[nodiscard]] bool is_acknowledged() const {
    return dds_wait_for_acks(writer_.handle(), DDS_SECS(kPatience.count())) == DDS_RETCODE_OK;
  }

 private:
  DdsEntity topic_;
  DdsEntity writer_;
};

inline std::string robot_name(RobotId id) {
  std::string name = "robot";
  name += std::to_string(id);
  return name;
}

/// The identity of a robot that starts.
inline RobotIdentity new_process(RobotId id) {
  return {id, robot_name(id), kProtocolVersion, random_boot_id()};
}

/// A robot that does nothing but talk: status, pings to all, pings to one.
struct TestRobot {
  using MakeSeal = std::function<std::shared_ptr<SharedSeal>(const RobotIdentity&)>;

  explicit TestRobot(std::shared_ptr<const DdsDomain> domain, RobotId id,
                     TopicKind ping_kind = TopicKind::kEvent,
                     TopicKind addressed_kind = TopicKind::kRequest)
      : TestRobot(std::move(domain), new_process(id), nullptr, ping_kind, addressed_kind) {}
  TestRobot(std::shared_ptr<const DdsDomain> domain, RobotId id, const MakeSeal& make_seal)
      : TestRobot(std::move(domain), new_process(id), make_seal) {}
  /// `network`: a domain that robots share, or a configuration.
  template <typename Network>
  TestRobot(Network network, const RobotIdentity& identity, const MakeSeal& make_seal,
            TopicKind ping_kind = TopicKind::kEvent, TopicKind addressed_kind = TopicKind::kRequest,
            const BudgetConfig& budget = {})
      : participant(std::move(network), identity, make_seal ? make_seal(identity) : nullptr),
        bridge(participant, budget),
        status([identity] { return RobotStatus{.robot = identity.robot, .name = identity.name}; },
               {.own = statuses.to_peers(), .peers = statuses.from_peers()}),
        peer_events(bridge.peers().events()),
        received(pings.from_peers()),
        received_addressed(addressed_pings.from_peers()) {
    bridge.exchange(statuses, TopicKind::kStatus, TrafficCategory::kOther);
    bridge.exchange(pings, ping_kind, TrafficCategory::kPlaceRecognition);
    bridge.exchange(addressed_pings, addressed_kind, TrafficCategory::kGeometricVerification);
  }
  ~TestRobot() { stop(); }

  void start() {
    bridge.start();
    status.start();
  }
  void stop() {
    status.stop();
    bridge.stop();
  }
  RobotId id() const { return participant.identity().robot; }
  void ping(std::uint32_t index, std::vector<std::uint8_t> payload = {}) {
    pings.to_peers().publish({id(), index, std::move(payload)});
  }
  void ping_one(RobotId to, std::uint32_t index, std::vector<std::uint8_t> payload = {}) {
    addressed_pings.to_peers().publish(
        {to, std::make_shared<const Ping>(Ping{id(), index, std::move(payload)})});
  }
  static std::size_t matching(const std::vector<PeerEvent>& events, PeerEventKind kind,
                              RobotId robot) {
    std::size_t found = 0;
    for (const PeerEvent& event : events)
      found += event.kind == kind && event.identity.robot == robot ? 1 : 0;
    return found;
  }
  /// True once there have been `count` such events.
  bool receives(PeerEventKind kind, RobotId robot, std::size_t count = 1) {
    const auto events =
        peer_events.wait_until([&](const auto& e) { return matching(e, kind, robot) >= count; });
    return matching(events, kind, robot) >= count;
  }
  /// Counts of the pings to all, or of those addressed to one robot.
  TopicTraffic traffic(Direction direction, bool addressed = false) {
    return traffic(Codec<Ping>::kTopic, direction, category(addressed));
  }
  TopicTraffic traffic(const std::string& topic, Direction direction, TrafficCategory category) {
    for (const TopicTraffic& t : bridge.traffic().topics)
      if (t.topic == topic && t.direction == direction && t.category == category) return t;
    return {};
  }
  /// How many messages of a topic, to all or to it alone, it has refused.
  std::uint64_t refused(const std::string& topic = Codec<Ping>::kTopic) {
    std::uint64_t count = 0;
    for (const TopicTraffic& t : bridge.traffic().topics)
      if (t.topic == topic)
        for (const auto& [reason, times] : t.refused) count += times;
    return count;
  }
  /// traffic() with one peer.
  TrafficCount traffic_with(RobotId peer, Direction direction, bool addressed = false) {
    for (const PeerTraffic& t : bridge.traffic().peers)
      if (t.topic == Codec<Ping>::kTopic && t.direction == direction && t.peer == peer &&
          t.category == category(addressed))
        return t.count;
    return {};
  }
  /// How many statuses it has sent.
  std::uint64_t status_count() {
    return traffic(Codec<RobotStatus>::kTopic, Direction::kOut, TrafficCategory::kOther)
        .count.messages;
  }
  static TrafficCategory category(bool addressed) {
    return addressed ? TrafficCategory::kGeometricVerification : TrafficCategory::kPlaceRecognition;
  }

  DdsParticipant participant;
  Crossing<RobotStatus> statuses;
  Crossing<Ping> pings;
  AddressedCrossing<Ping> addressed_pings;
  DdsBridge bridge;
  RobotStatusNode status;
  Inbox<PeerEvent> peer_events;
  Inbox<Ping> received, received_addressed;
};

/// Starts robots, and waits until each of them receives all others.
inline void meet(const std::vector<TestRobot*>& robots) {
  for (TestRobot* robot : robots) robot->start();
  for (TestRobot* robot : robots)
    for (const TestRobot* other : robots)
      if (other != robot) REQUIRE(robot->receives(PeerEventKind::kJoined, other->id()));
}

/// The head of an envelope that `identity` writes as its message `number`.
inline km_wire_Envelope header(const RobotIdentity& identity, std::uint32_t number) {
  return {.key = 0,
          .boot = identity.boot,
          .number = number,
          .version = 1,
          .robot = identity.robot,
          .content = {}};
}

/// Ascending.
inline std::vector<std::uint32_t> indices(const std::vector<Ping>& pings) {
  std::vector<std::uint32_t> result;
  for (const Ping& ping : pings) result.push_back(ping.index);
  std::ranges::sort(result);
  return result;
}

/// 0, 1, ..., count - 1.
inline std::vector<std::uint32_t> up_to(std::uint32_t count) {
  std::vector<std::uint32_t> result(count);
  std::iota(result.begin(), result.end(), 0U);
  return result;
}

/// Two robots of one domain that know of each other.
struct Two {
  explicit Two(const DdsConfig& config = loopback_config())
      : domain(std::make_shared<const DdsDomain>(config)) {
    meet({&a, &b});
  }

  std::shared_ptr<const DdsDomain> domain;
  TestRobot a{domain, 3}, b{domain, 4};
};

}  // namespace km
