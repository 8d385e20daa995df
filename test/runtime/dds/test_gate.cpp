#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <future>
#include <random>

#include "test/runtime/dds/dds_fixture.hpp"

namespace km {
namespace {

DdsEntity participant_with(const DdsConfig& config, const std::string& user_data) {
  const DdsQos qos = make_dds_qos();
  dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  return {dds_create_participant(static_cast<dds_domainid_t>(config.domain), qos.get(), nullptr),
          "participant"};
}

std::uint64_t refusals(TestRobot& robot, const std::string& reason) {
  return robot.traffic(Direction::kIn).refused[reason];
}

TEST_CASE("Bytes that are no message are refused and later messages are received", "[gate]") {
  Two two;
  auto& [domain, a, b] = two;
  RawWriter writer(a.participant.handle(), domain->config(), TopicKind::kEvent);
  const auto seed = GENERATE(1U, 2U);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<int> byte(0, 255), length(0, 300);
  constexpr std::uint32_t kCount = 200;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(length(rng)));
    for (std::uint8_t& x : bytes) x = static_cast<std::uint8_t>(byte(rng));
    km_wire_Envelope head = header(a.participant.identity(), i);
    head.key = i;
    writer.write_bytes(head, bytes);
  }
  writer.write(header(a.participant.identity(), kCount), {3, 7, {}});
  const auto pings = b.received.wait_until(
      [](const auto& p) { return std::ranges::count(p, 7U, &Ping::index) > 0; });
  CHECK_FALSE(pings.empty());
  CHECK(refusals(b, "not deserializable") > kCount / 2);
}

TEST_CASE("A message larger than its topic allows is not even read", "[gate]") {
  Two two;
  auto& [domain, a, b] = two;
  RawWriter writer(a.participant.handle(), domain->config(), TopicKind::kEvent);
  writer.write(header(a.participant.identity(), 0), {3, 0, std::vector<std::uint8_t>(200000)});
  CHECK(eventually([&] { return refusals(b, "larger than its topic allows") == 1; }));
  a.ping(1, std::vector<std::uint8_t>(200000));  // nor is it sent by a program that is sound
  CHECK(eventually([&] { return a.traffic(Direction::kOut).failures == 1; }));
  a.ping(2);
  CHECK(b.received.wait_for(1)[0].index == 2);
}

TEST_CASE("Messages that a robot sent before it left are received", "[gate]") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3);
  std::promise<void> leave;
  const std::shared_future<void> left = leave.get_future();
  a.pings.from_peers().subscribe([left](const auto&) { left.wait(); });
  a.start();
  {
    TestRobot b(domain, 4);
    b.start();
    REQUIRE(b.receives(PeerEventKind::kJoined, 3));
    for (std::uint32_t i = 0; i < 50; ++i) b.ping(i);
    REQUIRE(eventually([&] { return b.traffic(Direction::kOut).count.messages == 50; }));
  }
  REQUIRE(a.receives(PeerEventKind::kLeft, 4));
  leave.set_value();
  CHECK(a.received.wait_for(50).size() == 50);
}

TEST_CASE("No participant can send in a robot's name, not even from a writer that is gone",
          "[gate]") {
  Two two;
  auto& [domain, a, b] = two;
  const bool shows_the_id = GENERATE(false, true);
  {
    const DdsEntity outsider = participant_with(
        domain->config(), shows_the_id ? to_user_data(a.participant.identity()) : "");
    RawWriter writer(outsider.handle(), domain->config(), TopicKind::kEvent);
    for (std::uint32_t i = 0; i < 60; ++i)
      writer.write(header(a.participant.identity(), 1000 + i), {3, 1000 + i, {}});
    REQUIRE(writer.is_read_by(2));
    REQUIRE(writer.is_acknowledged());
  }
  a.ping(1);
  REQUIRE(b.received.wait_for(1)[0].index == 1);
  CHECK(eventually([&] { return b.refused() == 60; }));
  CHECK(b.received.messages().size() == 1);
}

TEST_CASE("A peer that sends much delays only its own messages", "[gate]") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3), b(domain, 4), c(domain, 5);
  constexpr std::uint32_t kFlood = 2000;
  Topic<Ping> handled;
  Inbox<Ping> in_order(handled);
  Worker<std::shared_ptr<const Ping>> node(
      kFlood, Overflow::kBlock, [&](const auto& ping) { handled.publish(ping); }, "node");
  c.pings.from_peers().subscribe([&](const auto& ping) { node.post(ping); });
  for (TestRobot* robot : {&a, &b, &c}) robot->start();
  REQUIRE(c.receives(PeerEventKind::kJoined, 3));
  REQUIRE(c.receives(PeerEventKind::kJoined, 4));
  for (std::uint32_t i = 0; i < kFlood; ++i) a.ping(i);
  REQUIRE(eventually([&] { return c.received.messages().size() > 10; }));
  b.ping(99999);
  REQUIRE(eventually([&] { return b.traffic(Direction::kOut).count.messages == 1; }));
  node.start();
  const auto pings = in_order.wait_for(kFlood + 1);
  REQUIRE(pings.size() == kFlood + 1);
  const auto place = std::ranges::find(pings, 99999U, &Ping::index) - pings.begin();
  CHECK(place < kFlood / 2);
  node.stop();
}

TEST_CASE("Only the status of a robot's twin makes it yield", "[gate]") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  TestRobot a(domain, 3);
  a.start();
  REQUIRE(eventually([&] { return a.status_count() >= 4; }));
  TestRobot twin(domain, 3);
  twin.start();
  CHECK(twin.receives(PeerEventKind::kConflict, 3));
  CHECK(a.receives(PeerEventKind::kRefused, 3));
  CHECK(TestRobot::matching(a.peer_events.messages(), PeerEventKind::kConflict, 3) == 0);
  twin.ping(0);
  CHECK(eventually([&] { return refusals(a, "claims this robot's id") == 1; }));
}

// An envelope as DDS keeps it, and with it what DDS reads others with.
class LocalEnvelope {
 public:
  explicit LocalEnvelope(const DdsConfig& config) : participant_(participant_with(config, "")) {
    const DdsQos qos = make_dds_qos();
    dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
    const dds_entity_t topic = dds_create_topic(participant_.handle(), &km_wire_Envelope_desc,
                                                "envelopes", nullptr, nullptr);
    const dds_entity_t reader = dds_create_reader(participant_.handle(), topic, qos.get(), nullptr);
    const dds_entity_t writer = dds_create_writer(participant_.handle(), topic, qos.get(), nullptr);
    km_wire_Envelope envelope = header({3, "robot", kProtocolVersion, 70}, 9);
    std::vector<std::uint8_t> content(100, 7);
    borrow(envelope.content, content);
    check_dds(dds_write(writer, &envelope), "write");
    dds_sample_info_t info{};
    REQUIRE(eventually(
        [&] { return dds_takecdr(reader, &serialized_, 1, &info, DDS_ANY_STATE) == 1; }));
  }
  ~LocalEnvelope() { ddsi_serdata_unref(serialized_); }
  LocalEnvelope(const LocalEnvelope&) = delete;
  LocalEnvelope& operator=(const LocalEnvelope&) = delete;

  [[nodiscard]] std::vector<std::uint8_t> bytes() const {
    std::vector<std::uint8_t> result(ddsi_serdata_size(serialized_));
    ddsi_serdata_to_ser(serialized_, 0, result.size(), result.data());
    return result;
  }
  // The path of messages that arrive on the network. False if DDS refuses the message.
  [[nodiscard]] bool reads(std::vector<std::uint8_t> bytes) const {
    const ddsrt_iovec_t part{bytes.data(), bytes.size()};
    ddsi_serdata* received =
        ddsi_serdata_from_ser_iov(serialized_->type, SDK_DATA, 1, &part, bytes.size());
    if (received == nullptr) return false;
    km_wire_Envelope envelope{};
    const bool usable = ddsi_serdata_to_sample(received, &envelope, nullptr, nullptr);
    if (usable) CHECK(envelope.content._length <= bytes.size());
    dds_sample_free(&envelope, &km_wire_Envelope_desc, DDS_FREE_CONTENTS);
    ddsi_serdata_unref(received);
    return usable;
  }

 private:
  DdsEntity participant_;
  ddsi_serdata* serialized_ = nullptr;
};

TEST_CASE("Envelopes of any bytes are read or refused by DDS itself", "[gate]") {
  const auto domain = std::make_shared<const DdsDomain>(loopback_config());
  const LocalEnvelope sound(domain->config());
  const std::vector<std::uint8_t> bytes = sound.bytes();
  REQUIRE(sound.reads(bytes));
  std::mt19937 rng(1);
  const auto below = [&](std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(rng);
  };
  int refused = 0;
  for (int i = 0; i < 100'000; ++i) {
    std::vector<std::uint8_t> corrupted = bytes;
    for (std::size_t k = below(3); k < 3; ++k)
      corrupted[below(i % 2 == 0 ? corrupted.size() : 40)] = static_cast<std::uint8_t>(below(256));
    if (below(2) == 0) corrupted.resize(below(corrupted.size()) / 4 * 4 + 4);
    refused += sound.reads(corrupted) ? 0 : 1;
  }
  CHECK(refused > 10'000);
}

}  // namespace
}  // namespace km
