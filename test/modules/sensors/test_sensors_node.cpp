#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <future>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "modules/sensors/node/sensors_node.hpp"

namespace km {
namespace {

// `count` packets `period_s` apart without pixels; then the end, or an exception.
class FakeReader final : public DatasetReader {
 public:
  explicit FakeReader(int count, double period_s = 0.05, bool fails = false)
      : count_(count), period_s_(period_s), fails_(fails) {}

  const SensorRig& rig() const override { return rig_; }
  ReaderReport report() const override { return report_; }
  std::size_t pair_count() const override { return static_cast<std::size_t>(count_); }
  using DatasetReader::next;
  std::optional<SensorPacket> next(const ChooseUse& choose) override {
    while (read_ < count_ && choose(1 + nanoseconds(period_s_ * read_), 0) == FrameUse::kNone)
      ++read_;
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
  SensorsTopics topics() {
    return {.processed = processed,
            .packets = packets,
            .load = load,
            .end = [this](const SensorsEnd& end) { ended.set_value(end); }};
  }

  Topic<ProcessedFrame> processed;
  Topic<SensorPacket> packets;
  Topic<ShedLoad> load;
  std::vector<Stamp> stamps;
  std::promise<SensorsEnd> ended;

  Run() {
    packets.subscribe([this](const auto& packet) {
      stamps.push_back(packet->frame->stamp);
      processed.publish(ProcessedFrame{packet->frame->stamp, 1.0});
    });
  }
};

}  // namespace

TEST_CASE("Every packet is published in order, then the end", "[sensors]") {
  const PlaybackPace pace =
      GENERATE(PlaybackPace::fastest(), PlaybackPace{1000.0, true}, PlaybackPace{1000.0, false});
  Run run;
  SensorsConfig config;
  config.max_lag_s = 1e6;
  SensorsNode node(config, pace, std::make_unique<FakeReader>(100), run.topics());
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

// Odometry that takes three times the interval of the images.
TEST_CASE("Images that come too fast are dropped evenly after the map", "[sensors]") {
  constexpr double kRate = 10.0;  // an image every 5 ms
  constexpr auto kCost = std::chrono::milliseconds(15);
  Run run;
  std::vector<ShedLoad> loads;
  run.load.subscribe([&](const auto& load) { loads.push_back(*load); });
  run.packets.subscribe([&](const auto&) { std::this_thread::sleep_for(kCost); });
  SensorsConfig config;
  config.max_lag_s = 0.1;
  SensorsNode node(config, {kRate, false}, std::make_unique<FakeReader>(1000), run.topics());
  node.start();
  const SensorsEnd end = run.ended.get_future().get();
  node.stop();
  CHECK(end.published + end.skipped == 1000);
  CHECK(end.skipped > 500);
  REQUIRE(loads.size() >= 2);
  CHECK(loads[0] == ShedLoad{.map = true, .stride = 1});
  CHECK(loads[1] == ShedLoad{.map = true, .stride = 2});
  for (std::size_t k = 1; k < run.stamps.size(); ++k) {
    CAPTURE(k);
    CHECK(seconds_between(run.stamps[k - 1], run.stamps[k]) <=
          0.05 * LoadShedding::kMaxStride + 1e-6);
  }
}

TEST_CASE("A recording that waits loses no image and no frame of the map", "[sensors]") {
  constexpr double kRate = 10.0;  // an image every 5 ms
  constexpr auto kCost = std::chrono::milliseconds(15);
  Run run;
  int loads = 0;
  run.load.subscribe([&](const auto&) { ++loads; });
  run.packets.subscribe([&](const auto&) { std::this_thread::sleep_for(kCost); });
  SensorsConfig config;
  config.max_lag_s = 0.1;
  SensorsNode node(config, {kRate, true}, std::make_unique<FakeReader>(100), run.topics());
  node.start();
  const SensorsEnd end = run.ended.get_future().get();
  node.stop();
  CHECK(end.published == 100);
  CHECK(end.skipped == 0);
  CHECK(loads == 0);
  // 92 images take 1.38 s before the last one is read, which is due after 0.495 s and may be late
  // by twice max_lag_s.
  CHECK(end.paused_s > 0.5);
}

TEST_CASE("A node that waits for the next packet stops at once", "[sensors]") {
  Run run;
  std::promise<void> first;
  run.packets.subscribe([&](const auto&) { first.set_value(); });
  // The second packet is due in an hour; the reader is not exhausted either.
  SensorsNode node({}, {}, std::make_unique<FakeReader>(1000, 3600.0), run.topics());
  node.start();
  first.get_future().get();
  node.stop();
  node.stop();
  CHECK(run.stamps.size() == 1);
  CHECK(node.published() == 1);
}

TEST_CASE("A reader that throws ends the node with its exception", "[sensors]") {
  Run run;
  SensorsNode node({}, PlaybackPace::fastest(), std::make_unique<FakeReader>(3, 0.05, true),
                   run.topics());
  node.start();
  while (node.error() == nullptr) std::this_thread::yield();
  node.stop();
  CHECK_THROWS_WITH(std::rethrow_exception(node.error()), "disk gone");
  CHECK(run.stamps.size() == 3);
}

}  // namespace km
