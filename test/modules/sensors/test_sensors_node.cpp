#include <catch2/catch.hpp>
#include <cmath>
#include <future>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "modules/sensors/sensors_node.hpp"

namespace km {
namespace {

constexpr double kMax = std::numeric_limits<double>::infinity();

// `count` packets `period_s` apart without pixels; then the end, or an exception.
class FakeReader final : public DatasetReader {
 public:
  explicit FakeReader(int count, double period_s = 0.05, bool fails = false)
      : count_(count), period_s_(period_s), fails_(fails) {}

  const SensorRig& rig() const override { return rig_; }
  ReaderReport report() const override { return report_; }
  std::size_t pair_count() const override { return static_cast<std::size_t>(count_); }
  std::optional<SensorPacket> next() override {
    if (read_ == count_ && fails_) throw DatasetError("disk gone");
    if (read_ == count_) {
      report_.add(ReaderFault::kMissingImage, "x.csv line 3");
      return std::nullopt;
    }
    auto frame = std::make_shared<StereoFrame>();
    frame->stamp = 1 + nanoseconds(period_s_ * read_++);
    ImuSample sample;
    sample.stamp = frame->stamp;
    return SensorPacket{std::move(frame), {sample}};
  }

 private:
  int count_;
  double period_s_;
  bool fails_;
  int read_ = 0;
  SensorRig rig_;
  ReaderReport report_;
};

struct Run {
  SensorsTopics topics() { return {.packets = packets, .end = end}; }

  Topic<SensorPacket> packets;
  Topic<SensorsEnd> end;
  std::vector<Stamp> stamps;
  std::promise<SensorsEnd> ended;

  Run() {
    packets.subscribe([this](const auto& packet) { stamps.push_back(packet->frame->stamp); });
    end.subscribe([this](const auto& message) { ended.set_value(*message); });
  }
};

constexpr Stamp kSecond = 1'000'000'000;
constexpr Stamp kImuPeriod = kSecond / 100;

// A packet at `t` with samples every 10 ms over the 50 ms up to it.
std::shared_ptr<const SensorPacket> packet_at(Stamp t) {
  auto frame = std::make_shared<StereoFrame>();
  frame->stamp = t;
  auto packet = std::make_shared<SensorPacket>();
  for (Stamp s = t - 5 * kImuPeriod; s <= t; s += kImuPeriod) packet->imu.emplace_back().stamp = s;
  packet->frame = std::move(frame);
  return packet;
}

}  // namespace

TEST_CASE("Every packet is published in order, then the end", "[sensors]") {
  const double rate = GENERATE(as<double>{}, kMax, 1000.0);
  Run run;
  SensorsConfig config;
  config.max_lag_s = 1e6;
  SensorsNode node(config, rate, std::make_unique<FakeReader>(100), run.topics());
  node.start();
  const SensorsEnd end = run.ended.get_future().get();
  node.stop();
  REQUIRE(run.stamps.size() == 100);
  CHECK(std::is_sorted(run.stamps.begin(), run.stamps.end()));
  CHECK(end.published == 100);
  CHECK(end.skipped == 0);
  CHECK(end.faults.count(ReaderFault::kMissingImage) == 1);
  CHECK(node.published() == 100);
  CHECK(node.timing().count() == 101);  // the end is read too
  CHECK(node.error() == nullptr);
}

TEST_CASE("Pairs that are late at a finite rate are skipped and counted", "[sensors]") {
  Run run;
  SensorsConfig config;
  config.max_lag_s = 0.0;
  // At this rate all packets are due with the first one: the others are late.
  SensorsNode node(config, 1e12, std::make_unique<FakeReader>(10), run.topics());
  node.start();
  const SensorsEnd end = run.ended.get_future().get();
  CHECK(end.published == 1);
  CHECK(end.skipped == 9);
}

TEST_CASE("A node that waits for the next packet stops at once", "[sensors]") {
  Run run;
  std::promise<void> first;
  run.packets.subscribe([&](const auto&) { first.set_value(); });
  // The second packet is due in an hour; the reader is not exhausted either.
  SensorsNode node({}, 1.0, std::make_unique<FakeReader>(1000, 3600.0), run.topics());
  node.start();
  first.get_future().get();
  node.stop();
  node.stop();
  CHECK(run.stamps.size() == 1);
  CHECK(node.published() == 1);
}

TEST_CASE("A reader that throws ends the node with its exception", "[sensors]") {
  Run run;
  SensorsNode node({}, kMax, std::make_unique<FakeReader>(3, 0.05, true), run.topics());
  node.start();
  while (node.error() == nullptr) std::this_thread::yield();
  node.stop();
  CHECK_THROWS_WITH(std::rethrow_exception(node.error()), "disk gone");
  CHECK(run.stamps.size() == 3);
}

TEST_CASE("Unusable parameters of the node are refused", "[sensors]") {
  Run run;
  SensorsConfig config;
  config.read_ahead = 0;
  CHECK_THROWS_AS(SensorsNode(config, 1.0, std::make_unique<FakeReader>(1), run.topics()),
                  ConfigError);
  CHECK_THROWS_AS(SensorsNode({}, 0.0, std::make_unique<FakeReader>(1), run.topics()),
                  std::invalid_argument);
}

TEST_CASE("A packet in time passes as it is", "[sensors]") {
  LagFilter filter(0.2);
  const auto packet = packet_at(kSecond);
  CHECK(filter.take(packet, 0.2) == packet);
}

TEST_CASE("A late packet is given up, its samples come with the next", "[sensors]") {
  LagFilter filter(0.2);
  CHECK(filter.take(packet_at(kSecond), 0.3) == nullptr);
  CHECK(filter.take(packet_at(kSecond + 5 * kImuPeriod), 0.25) == nullptr);
  const auto joined = filter.take(packet_at(kSecond + 10 * kImuPeriod), 0.1);
  REQUIRE(joined);
  CHECK(joined->frame->stamp == kSecond + 10 * kImuPeriod);
  REQUIRE(joined->imu.size() == 16);  // 150 ms, no sample twice
  for (std::size_t i = 0; i < joined->imu.size(); ++i)
    CHECK(joined->imu[i].stamp == kSecond + (static_cast<Stamp>(i) - 5) * kImuPeriod);
  const auto next = packet_at(kSecond + 15 * kImuPeriod);
  CHECK(filter.take(next, 0.0) == next);
}

TEST_CASE("A lag without sense is refused", "[sensors]") {
  CHECK_THROWS_AS(LagFilter(-0.1), std::invalid_argument);
  CHECK_THROWS_AS(LagFilter(std::nan("")), std::invalid_argument);
}

}  // namespace km
