#include "apps/publish/message_player.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "runtime/ros/ros_subscription.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/modules/sensors/listed_bag.hpp"
#include "test/support/command.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

constexpr int kMessages = 200;
constexpr Stamp kFirst = 5'000'000'000, kPeriod = 1'000'000;

std::shared_ptr<const RosNetwork> network() {
  static const auto shared = std::make_shared<const RosNetwork>(
      RosConfig{.domain = static_cast<int>(std::random_device()() % 100), .interface = "lo"});
  return shared;
}

std::unique_ptr<ListedBag> samples(const std::string& topic = "/imu", Stamp period = kPeriod) {
  auto bag = std::make_unique<ListedBag>();
  for (int k = 0; k < kMessages; ++k) {
    RosImu message;
    message.header.stamp = kFirst + k * period;
    bag->add(topic, message);
  }
  return bag;
}

// Stamps of the received messages.
std::vector<Stamp> played(std::unique_ptr<BagReader> bag, const std::string& topic,
                          PlayOptions options, PlayedTopic& played) {
  options.reliable = true;
  MessagePlayer player(std::move(bag), network(), options);
  RosSubscription reader(network(), {{topic, "sensor_msgs/Imu", RosQos::kReliable, kMessages}});
  while (!player.topics_short_of(1).empty())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  while (player.step()) {
  }
  played = player.topics().at(0);
  std::vector<Stamp> stamps;
  while (stamps.size() < played.published) {
    const auto message = reader.next();
    stamps.push_back(decode_ros<RosHeader>("cdr", message->bytes).value->stamp);
  }
  return stamps;
}

TEST_CASE("A recording is played in its order and pace") {
  PlayedTopic topic;
  const auto begin = std::chrono::steady_clock::now();
  const auto stamps = played(samples("/a"), "/a", {.rate = 2.0}, topic);
  CHECK(std::chrono::steady_clock::now() - begin >= std::chrono::milliseconds(99));  // 0.199 s
  CHECK(topic.published == kMessages);
  CHECK(topic.dropped == 0);
  REQUIRE(stamps.size() == kMessages);
  CHECK(stamps.front() == kFirst);
  CHECK(std::ranges::is_sorted(stamps));
}

TEST_CASE("A part of a recording is played without waiting for its start") {
  constexpr Stamp kMinute = 60'000'000'000;
  PlayedTopic topic;
  const auto begin = std::chrono::steady_clock::now();
  const auto stamps = played(samples("/part", kMinute), "/part",
                             {.rate = 60.0, .from_s = 9000.0, .to_s = 9060.0}, topic);
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(150));  // that of the wait
  REQUIRE(stamps.size() == 1);
  CHECK(stamps.front() == kFirst + 150 * kMinute);
}

TEST_CASE("A bad driver loses and delays messages, the same ones for a seed") {
  const PlayOptions bad{.rate = 10.0, .jitter_s = 0.002, .drop_share = 0.3, .seed = 7};
  PlayedTopic topic;
  const auto stamps = played(samples("/b"), "/b", bad, topic);
  CHECK(topic.published + topic.dropped == kMessages);
  CHECK(topic.dropped > 30);
  CHECK(topic.dropped < 90);
  CHECK_FALSE(std::ranges::is_sorted(stamps));  // by up to 20 ms of the recording's time
  for (std::size_t k = 1; k < stamps.size(); ++k) CHECK(stamps[k] > stamps[k - 1] - 20'000'000);
  CHECK(played(samples("/b"), "/b", bad, topic) == stamps);
}

TEST_CASE("Unknown topics are left out and broken messages are counted") {
  auto bag = samples("/c");
  bag->add_bytes("/scan", "sensor_msgs/LaserScan", kFirst, {0, 1, 0, 0});
  bag->add_bytes("/c", RosImu::kType, kFirst, {0, 0, 0, 0, 1});  // big-endian, and cut
  MessagePlayer player(std::move(bag), network(), {.rate = 100.0});
  CHECK(player.unsupported_topics() == std::vector<std::string>{"/scan (sensor_msgs/LaserScan)"});
  while (player.step()) {
  }
  REQUIRE(player.topics().size() == 1);
  CHECK(player.topics()[0].published == kMessages);
  CHECK(player.topics()[0].refused == 1);
  CHECK_THROWS_WITH(MessagePlayer(samples("/d"), network(), {.topics = {"/e"}}),
                    "the recording has no topic /e");
}

TEST_CASE("Playing waits for readers of images and inertial samples alone") {
  auto bag = samples("/f");
  for (const auto& [topic, type] : {std::pair("/left", RosCompressedImage::kType),
                                    std::pair("/left_info", RosCameraInfo::kType),
                                    std::pair("/tf_static", RosTFMessage::kType)})
    bag->describe(topic, type);
  const MessagePlayer player(std::move(bag), network(), {});
  CHECK(player.topics().size() == 4);
  CHECK(player.topics_short_of(1) == std::vector<std::string>{"/f", "/left"});
  CHECK(player.topics_short_of(0).empty());
}

TEST_CASE("Waiting for readers ends with the topics that have too few") {
  const EurocFolder folder;
  const CommandResult result =
      run_command(KM_BIN_DIR "/kimera_multi_publish " + folder.root().string() +
                  " --interface lo --wait 1 --patience 0.1 --domain " +
                  std::to_string(std::random_device()() % 100));
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Contains("still too few readers on ROS domain") &&
                                Contains("of /imu0, /cam0/image_raw, /cam1/image_raw: 1"));
}

TEST_CASE("A folder that cannot be played is refused with its layout") {
  const TemporaryFolder folder;
  folder.write("camera-intrinsics.txt", "");
  const CommandResult result =
      run_command(KM_BIN_DIR "/kimera_multi_publish " + folder.path().string());
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.output, Contains("7-Scenes") && Contains("only bags and folders"));
}

TEST_CASE("Fixes are played in the order of time with the messages of the recording") {
  constexpr Stamp kLast = kFirst + (kMessages - 1) * kPeriod;
  const auto [type, gnss] =
      GENERATE(std::pair(kGnssType, true), std::pair(kMotionCaptureType, false));
  const auto messages = with_fixes(samples("/i"),
                                   {{kFirst + 5, {47.0, 8.0, 500.0}},
                                    {kFirst - 1, {1.0, 1.0, 1.0}},
                                    {kLast - 5, {48.0, 9.0, 600.0}},
                                    {kLast + 1, {2.0, 2.0, 2.0}}},
                                   "/fix", type);
  REQUIRE(messages->channels().size() == 2);
  Stamp last = 0;
  int count = 0;
  std::vector<Eigen::Vector3d> fixes;
  for (; const auto message = messages->next(); ++count) {
    CHECK(message->log_time >= last);
    last = message->log_time;
    if (message->channel != 1) continue;
    CHECK(decode_ros<RosHeader>("cdr", message->bytes).value->stamp == message->log_time);
    if (gnss) {
      const RosNavSatFix fix = *decode_ros<RosNavSatFix>("cdr", message->bytes).value;
      CHECK(fix.status.status >= 0);
      fixes.emplace_back(fix.latitude, fix.longitude, fix.altitude);
    } else {
      fixes.push_back(decode_ros<RosPoseStamped>("cdr", message->bytes).value->pose.position);
    }
  }
  CHECK(count == kMessages + 2);
  REQUIRE(fixes.size() == 2);
  CHECK(fixes[0] == Eigen::Vector3d(47.0, 8.0, 500.0));
  CHECK(fixes[1] == Eigen::Vector3d(48.0, 9.0, 600.0));
  CHECK_THROWS_WITH(with_fixes(samples("/i"), {}, "/i", type), Contains("--fix-topic"));
}

TEST_CASE("A EuRoC folder becomes the messages of its drivers") {
  const EurocFolder folder;
  const auto messages = euroc_messages(std::make_unique<FolderReader>(open_folder(folder.root())));
  std::map<std::string, int> counts;
  Stamp last = 0;
  while (const auto message = messages->next()) {
    ++counts[messages->channels()[message->channel].topic];
    CHECK(message->log_time >= last);
    last = message->log_time;
    CHECK(decode_ros<RosHeader>("cdr", message->bytes).value->stamp == message->log_time);
  }
  CHECK(counts["/cam0/image_raw"] == EurocFolder::kPairs);
  CHECK(counts["/cam1/image_raw"] == EurocFolder::kPairs);
  CHECK(counts["/imu0"] == 271);  // from a second before the first image to the last one
}

}  // namespace
}  // namespace km
