#include <view.h>

#include "modules/view/node/view_channel_codec.hpp"
#include "modules/view/node/view_listener_node.hpp"
#include "modules/view/view_incumbents.hpp"
#include "runtime/clock.hpp"
#include "test/runtime/dds/dds_fixture.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr double kPatience_s = static_cast<double>(kPatience.count());
constexpr std::array kChannels = {ViewChannel::kView, ViewChannel::kMesh, ViewChannel::kImages};

// The sending half of a robot.
struct Publisher {
  Publisher(const std::shared_ptr<const DdsDomain>& domain, RobotId robot)
      : participant(domain, {.robot = robot, .name = robot_name(robot), .boot = 50U + robot}) {
    for (const ViewChannel channel : kChannels)
      writers.emplace_back(participant.handle(), channel, TeamPeer{robot, 50U + robot});
  }
  ViewWriter& on(ViewChannel channel) { return writers[static_cast<std::size_t>(channel)]; }
  void publish(const ViewContent& content) { on(channel_of(content)).write(content); }

  DdsParticipant participant;
  std::vector<ViewWriter> writers;
};

MeshChunk chunk(std::int32_t x) {
  return {
      .key = {0, {x, 0, 0}, 0}, .offsets = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}}, .faces = {{0, 1, 2}}};
}

struct Watching {
  std::shared_ptr<const DdsDomain> domain = std::make_shared<DdsDomain>(loopback_config());
  Publisher publisher{domain, 7};
  ViewListener listener{domain};

  [[nodiscard]] bool is_read(ViewChannel channel, std::size_t readers = 1) {
    return eventually([&] { return publisher.on(channel).readers() == readers; });
  }
  [[nodiscard]] ViewUpdate received() {
    auto update = listener.next(kPatience_s);
    REQUIRE(update);
    return *std::move(update);
  }
};

TEST_CASE("A viewer receives the updates of robots in order") {
  Watching w;
  REQUIRE(w.is_read(ViewChannel::kView));
  REQUIRE(w.is_read(ViewChannel::kMesh));
  constexpr std::uint32_t kCount = 500;
  for (std::uint32_t k = 0; k < kCount; ++k)
    w.publisher.publish(ViewKeyframes{.first = k, .T_world_kf = {}});
  for (std::uint32_t k = 0; k < kCount; ++k) {
    const ViewUpdate update = w.received();
    CHECK(update.robot == 7);
    CHECK(update.boot == 57);
    CHECK(std::abs(seconds_between(update.sent, nanoseconds(wall_now_s()))) < kPatience_s);
    REQUIRE(std::holds_alternative<ViewKeyframes>(update.content));
    CHECK(std::get<ViewKeyframes>(update.content).first == k);
  }
  // More cells than a queue for one reader holds, each with a chunk of its own.
  for (std::int32_t x = 0; x < 100; ++x) w.publisher.publish(chunk(x));
  for (std::int32_t x = 0; x < 100; ++x) {
    const ViewUpdate update = w.received();
    REQUIRE(std::holds_alternative<MeshChunk>(update.content));
    const auto& piece = std::get<MeshChunk>(update.content);
    CHECK(piece.key.robot == 7);
    CHECK(piece.boot == 57);
    CHECK(piece.faces == chunk(x).faces);
  }
  CHECK(w.publisher.on(ViewChannel::kView).await_readers(kPatience_s));
  CHECK(w.listener.refused() == 0);
}

TEST_CASE("Images arrive only from the robots that are asked") {
  Watching w;
  Publisher other(w.domain, 8);
  REQUIRE(w.is_read(ViewChannel::kView));
  CHECK(w.publisher.on(ViewChannel::kImages).readers() == 0);
  w.listener.ask_for_images({7});
  CHECK_FALSE(w.listener.next(0.0));
  REQUIRE(w.is_read(ViewChannel::kImages));
  CHECK(other.on(ViewChannel::kImages).readers() == 0);
  w.publisher.publish(ViewImage{.stamp = 5, .jpeg = {1, 2, 3}, .features = {}});
  CHECK(std::get<ViewImage>(w.received().content).stamp == 5);

  w.listener.ask_for_images({8});
  CHECK_FALSE(w.listener.next(0.0));
  REQUIRE(w.is_read(ViewChannel::kImages, 0));
  CHECK(eventually([&] { return other.on(ViewChannel::kImages).readers() == 1; }));
}

TEST_CASE("Updates that no robot writes are counted and dropped") {
  Watching w;
  const DdsEntity topic = create_view_topic(w.publisher.participant.handle(), ViewChannel::kView);
  const DdsQos qos = make_dds_qos();
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  const DdsEntity outsider(
      dds_create_writer(w.publisher.participant.handle(), topic.handle(), qos.get(), nullptr),
      "writer");
  REQUIRE(eventually([&] {
    dds_publication_matched_status_t status{};
    dds_get_publication_matched_status(outsider.handle(), &status);
    return status.current_count == 1;
  }));
  const auto write = [&](std::vector<std::uint8_t> bytes) {
    km_wire_ViewUpdate wire{};
    borrow(wire.content, bytes);
    check_dds(dds_write(outsider.handle(), &wire), "write");
  };
  write({});
  write({77, 1, 2});
  write(encode_view(chunk(1)));  // Wrong channel for a chunk.
  write(std::vector<std::uint8_t>(kMaxViewBytes + 1));
  CHECK(eventually([&] {
    CHECK_FALSE(w.listener.next(0.0));
    return w.listener.refused() == 4;
  }));
}

TEST_CASE("Watching can be stopped") {
  Watching w;
  std::thread stopper([&] { w.listener.stop(); });
  CHECK_FALSE(w.listener.next(1000.0 * kPatience_s));
  stopper.join();
  CHECK_FALSE(w.listener.next(1000.0 * kPatience_s));
}

constexpr std::uint64_t kFirst = 50, kSecond = 60;

// Updates that counted, by boot id and keyframe.
struct Page {
  ViewIncumbents incumbents;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> shown;

  auto taker() {
    return [this](const ViewUpdate& update) {
      const auto* const keyframes = std::get_if<ViewKeyframes>(&update.content);
      if (keyframes != nullptr) shown.emplace_back(update.boot, keyframes->first);
    };
  }
  void serve(double now_s) { incumbents.serve(now_s, taker()); }
  void send(std::uint64_t boot, ViewContent content, double now_s) {
    incumbents.add({3, boot, 0, std::move(content)}, now_s, taker());
    serve(now_s);
  }
  void send(std::uint64_t boot, std::uint32_t keyframe, double now_s) {
    send(boot, ViewContent(ViewKeyframes{.first = keyframe}), now_s);
  }
};

using Shown = std::vector<std::pair<std::uint64_t, std::uint32_t>>;

TEST_CASE("A resumed robot is shown from its beginning once the former process is silent") {
  Page page;
  page.send(kFirst, 0, 0.0);
  for (std::uint32_t k = 0; k < 4; ++k) page.send(kSecond, k, 1.0 + k);
  CHECK(page.shown == Shown{{kFirst, 0}});
  page.serve(4.9);
  CHECK(page.shown.size() == 1);
  page.serve(5.0);
  CHECK(page.shown == Shown{{kFirst, 0}, {kSecond, 0}, {kSecond, 1}, {kSecond, 2}, {kSecond, 3}});
  page.send(kSecond, 4, 5.5);
  CHECK(page.shown.size() == 6);
  page.send(kFirst, 9, 6.0);  // Its last update, which is late.
  CHECK(page.shown.size() == 6);
}

TEST_CASE("After a robot has left another process with its id counts at once") {
  Page page;
  page.send(kFirst, 0, 0.0);
  page.send(kFirst, ViewContent(RobotSample{.name = "alice", .phase = "leaving"}), 1.0);
  page.send(kSecond, 0, 1.1);
  CHECK(page.shown == Shown{{kFirst, 0}, {kSecond, 0}});
}

TEST_CASE("The number of waiting updates is bounded") {
  Page page;
  for (std::uint32_t k = 0; k < ViewIncumbents::kMostWaiting + 100; ++k) {
    page.send(kFirst, k, 1e-3 * k);
    page.send(kSecond, k, 1e-3 * k);
  }
  CHECK(page.incumbents.dropped() == 100);
}

}  // namespace
}  // namespace km
