#include "modules/sensors/load_shedding.hpp"
#include "modules/sensors/node/sensors_node.hpp"
#include "test/support/test.hpp"

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
    ImuSample sample{.stamp = frame->stamp};
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

TEST_CASE("Every packet is published in order, then the end") {
  const PlaybackPace pace =
      GENERATE(PlaybackPace::fastest(), PlaybackPace{1000.0, true}, PlaybackPace{1000.0, false});
  Run run;
  SensorsConfig config{.max_lag_s = 1e6};
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
TEST_CASE("Images that come too fast are dropped evenly after the map") {
  constexpr double kRate = 10.0;  // an image every 5 ms
  constexpr auto kCost = std::chrono::milliseconds(15);
  Run run;
  std::vector<ShedLoad> loads;
  run.load.subscribe([&](const auto& load) { loads.push_back(*load); });
  run.packets.subscribe([&](const auto&) { std::this_thread::sleep_for(kCost); });
  SensorsConfig config{.max_lag_s = 0.1};
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

TEST_CASE("A recording that waits loses no image and no frame of the map") {
  constexpr double kRate = 10.0;  // an image every 5 ms
  constexpr auto kCost = std::chrono::milliseconds(15);
  Run run;
  int loads = 0;
  run.load.subscribe([&](const auto&) { ++loads; });
  run.packets.subscribe([&](const auto&) { std::this_thread::sleep_for(kCost); });
  SensorsConfig config{.max_lag_s = 0.1};
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

TEST_CASE("A node that waits for the next packet stops at once") {
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

TEST_CASE("A reader that throws ends the node with its exception") {
  Run run;
  SensorsNode node({}, PlaybackPace::fastest(), std::make_unique<FakeReader>(3, 0.05, true),
                   run.topics());
  node.start();
  while (node.error() == nullptr) std::this_thread::yield();
  node.stop();
  CHECK_THROWS_WITH(std::rethrow_exception(node.error()), "disk gone");
  CHECK(run.stamps.size() == 3);
}

namespace {

constexpr double kPeriod_s = 0.05;
constexpr double kMaxLag_s = 0.5;

// One odometry that needs `cost_s` for each image, simulated in virtual time. Images are due every
// 50 ms. The reader decides about an image when the queue has room for it.
struct Playback {
  double cost_s = 0.0;
  double share_per_s = 0.9;  // share of features that survive a second
  bool waits = true;         // a recording: its clock waits as the last resort

  LoadShedding shedding{kMaxLag_s};
  std::vector<FrameUse> uses{};
  std::vector<int> gaps{};  // images from one used image to the next
  std::vector<ShedLoad> loads{};
  double waited_s = 0.0, worst_lag_s = 0.0;

  void play(int images) {
    constexpr std::size_t kRoom = 4;
    struct Running {
      ProcessedFrame frame;
      double end_s = 0.0;
    };
    std::vector<Running> queue;
    double now_s = start_s;
    int last_used = -1;
    const auto finish_until = [&](double until_s) {
      while (!queue.empty() && queue.front().end_s <= until_s) {
        shedding.finish(queue.front().frame);
        queue.erase(queue.begin());
      }
    };
    for (int k = 0; k < images; ++k) {
      const double due_s = start_s + k * kPeriod_s + waited_s;
      now_s = std::max(now_s, due_s);
      if (queue.size() == kRoom) now_s = std::max(now_s, queue.front().end_s);
      finish_until(now_s);
      if (const double pause_s = shedding.pause_s(due_s, now_s); waits && pause_s > 0.0) {
        shedding.pause(pause_s);
        waited_s += pause_s;
      }
      worst_lag_s = std::max(worst_lag_s, shedding.lag_s(now_s));
      const Stamp stamp = first_stamp + nanoseconds(k * kPeriod_s);
      uses.push_back(shedding.use_next(stamp, start_s + k * kPeriod_s + waited_s, now_s));
      loads.push_back(shedding.load());
      if (uses.back() == FrameUse::kNone) continue;
      if (last_used >= 0) gaps.push_back(k - last_used);
      const int gap = last_used >= 0 ? k - last_used : 1;
      last_used = k;
      const double begin_s = queue.empty() ? now_s : std::max(now_s, queue.back().end_s);
      queue.push_back({{stamp, std::pow(share_per_s, gap * kPeriod_s)}, begin_s + cost_s});
    }
    start_s += images * kPeriod_s + waited_s;
    first_stamp += nanoseconds(images * kPeriod_s);
    waited_s = 0.0;
  }

  double start_s = 100.0;
  Stamp first_stamp = 1'000'000'000;
};

int first_with(const Playback& run, auto&& is) {
  for (std::size_t k = 0; k < run.loads.size(); ++k)
    if (is(run.loads[k])) return static_cast<int>(k);
  return -1;
}

}  // namespace

TEST_CASE("The map loses its frames first and then odometry every second image and both recover") {
  Playback run{.cost_s = 0.07};
  run.play(400);
  const int map = first_with(run, [](const ShedLoad& load) { return load.map; });
  const int half = first_with(run, [](const ShedLoad& load) { return load.stride > 1; });
  REQUIRE(map > 0);
  REQUIRE(half > map);
  for (int k = 0; k < map; ++k) CHECK(run.uses[static_cast<std::size_t>(k)] == FrameUse::kAll);
  for (const ShedLoad& load : run.loads) CHECK((load.stride == 1 || load.map));
  for (const int gap : run.gaps)
    CHECK(gap <= 2);  // a stride of 2 suffices, and images are used evenly
  CHECK(run.worst_lag_s < 2.0 * kMaxLag_s);

  run.cost_s = 0.01;
  run.uses.clear();
  run.play(1000);
  CHECK(run.uses.back() == FrameUse::kAll);
  CHECK(run.shedding.load() == ShedLoad{});

  Playback fast{.cost_s = 0.045};  // a robot that is fast enough drops no images
  fast.play(2000);
  for (const FrameUse use : fast.uses) REQUIRE(use == FrameUse::kAll);
  CHECK(fast.waited_s == 0.0);
}

TEST_CASE("Odometry keeps the images that it needs and the recording waits") {
  // A fifth of the features is lost from image to image. 0.64 of them survive to the second image,
  // 0.41 to the fourth.
  Playback run{.cost_s = 0.25, .share_per_s = std::pow(0.8, 1.0 / kPeriod_s)};
  run.play(1000);
  CHECK(run.shedding.max_stride() == 3);
  for (const int gap : run.gaps) CHECK(gap <= 3);
  CHECK(run.worst_lag_s <= 2.0 * kMaxLag_s + run.cost_s);
}

TEST_CASE("A step that has to be repeated is undone less and less often") {
  Playback run{.cost_s = 0.06};
  run.play(4000);
  int changes = 0;
  for (std::size_t k = 1; k < run.loads.size(); ++k)
    changes += run.loads[k].stride != run.loads[k - 1].stride ? 1 : 0;
  CHECK(changes >= 2);
  CHECK(changes < 40);  // 200 s; with a constant waiting time about one a second
}

TEST_CASE("A share of tracked features that is no number is ignored") {
  const double share = GENERATE(std::nan(""), HUGE_VAL, -1.0);
  CAPTURE(share);
  LoadShedding shedding(kMaxLag_s);
  for (int k = 0; k < 3; ++k) {
    const Stamp stamp = nanoseconds(kPeriod_s * k);
    CHECK(shedding.use_next(stamp, kPeriod_s * k, kPeriod_s * k) == FrameUse::kAll);
    shedding.finish({stamp, share});
  }
  CHECK(shedding.max_stride() == LoadShedding::kMaxStride);
}

TEST_CASE("An impossible lag is refused") {
  CHECK_THROWS_AS(LoadShedding(-0.1), std::invalid_argument);
  CHECK_THROWS_AS(LoadShedding(std::nan("")), std::invalid_argument);
}

}  // namespace km
