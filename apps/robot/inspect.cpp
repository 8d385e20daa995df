#include "apps/robot/inspect.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <iomanip>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "modules/absolute_fixes/fix_reader.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/core/io/text_table.hpp"
#include "modules/core/io/write_file.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/ros_dds/node/live_topics.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "modules/sensors/rig_completion.hpp"
#include "modules/sensors/sensor_messages.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"
#include "runtime/ros/ros_discovery.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

using Rows = std::vector<std::vector<std::string>>;

// Seconds with enough decimals to show milliseconds of a clock that counts from 1970.
std::string seconds_text(Stamp stamp) {
  constexpr Stamp kMillisecond_ns = 1'000'000;
  const Stamp ms = stamp / kMillisecond_ns;
  std::ostringstream text;
  text << (ms < 0 ? "-" : "") << std::abs(ms / 1000) << '.' << std::setw(3) << std::setfill('0')
       << std::abs(ms % 1000);
  return text.str();
}

std::string image_text(const TopicSummary& topic) {
  const bool was_looked_at = topic.is_image && !topic.encoding.empty() && !topic.stamps.empty();
  if (!topic.image) return was_looked_at ? "not decodable" : "-";
  const ImageSize size = topic.image->size;
  const std::string pixels =
      size == ImageSize{} ? "" : std::to_string(size.width) + 'x' + std::to_string(size.height);
  return readable(pixels + ' ' + topic.image->encoding, 40);
}

std::string topic_table(const std::vector<TopicSummary>& topics) {
  Rows rows = {{"topic", "type", "messages", "first [s]", "last [s]", "rate [Hz]",
                "largest gap [s]", "jitter [ms]", "unordered", "stamps of", "image"}};
  for (const TopicSummary& topic : topics) {
    const StampStatistics stamps = stamp_statistics(topic.stamps);
    const bool is_empty = stamps.count == 0;
    rows.push_back({readable(topic.topic, 80), readable(topic.type, 60),
                    std::to_string(stamps.count), is_empty ? "-" : seconds_text(stamps.first),
                    is_empty ? "-" : seconds_text(stamps.last), fixed(stamps.rate_hz, 2),
                    fixed(stamps.largest_gap_s, 3), fixed(1e3 * stamps.jitter_s, 2),
                    std::to_string(stamps.unordered), topic.has_sensor_stamps ? "sensor" : "log",
                    image_text(topic)});
  }
  return align_columns(rows);
}

std::string pair_table(const std::vector<TopicPair>& pairs) {
  Rows rows = {{"images of equal rate", "pairs", "equal stamps", "second - first [ms]",
                "largest deviation [ms]", "only first", "only second"}};
  for (const TopicPair& pair : pairs) {
    const StampAgreement& found = pair.agreement;
    rows.push_back({readable(pair.first + ' ' + pair.second, 160), std::to_string(found.pairs),
                    std::to_string(found.equal), fixed(1e3 * found.median_offset_s, 3),
                    fixed(1e3 * found.largest_deviation_s, 3), std::to_string(found.only_first),
                    std::to_string(found.only_second)});
  }
  return align_columns(rows);
}

std::string lower(std::string name) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name;
}

bool has_word(const TopicSummary& topic, std::string_view word) {
  return lower(topic.topic).find(word) != std::string::npos;
}

// Settings with which a robot uses the fixes of these topics. An estimate is no fix.
std::string fixes_text(const std::vector<TopicSummary>& topics) {
  constexpr std::array kEstimates = {"amcl", "slam", "odom", "vio",  "vins",     "ekf",
                                     "fuse", "goal", "plan", "init", "estimate", "filter"};
  std::string text;
  for (const TopicSummary& topic : topics)
    for (const auto& [name, source] : kFixSources) {
      const bool is_empty = topic.stamps.empty();
      if (is_empty || !has_fixes({topic.topic, topic.type, topic.encoding, 0}, source)) continue;
      if (std::ranges::any_of(kEstimates, [&](const char* w) { return has_word(topic, w); }))
        continue;
      text += readable(topic.topic) + ": positions; --set absolute_fixes.source=" + name +
              " absolute_fixes.topic=" + readable(topic.topic) +
              " if a receiver or a motion capture measures them, and not an estimator\n";
    }
  return text;
}

std::string text_of(const std::vector<TopicSummary>& topics) {
  std::string text = topic_table(topics);
  if (const auto pairs = pairs_of_images(topics); !pairs.empty()) text += '\n' + pair_table(pairs);
  for (const TopicSummary& topic : topics)
    if (topic.undecoded > 0)
      text += readable(topic.topic) + ": " + std::to_string(topic.undecoded) +
              " messages that are not of their type\n";
  return text + fixes_text(topics);
}

// Topics of a EuRoC folder: folders with a data.csv whose rows begin with a stamp.
std::vector<TopicSummary> euroc_topics(const fs::path& folder) {
  std::vector<TopicSummary> topics;
  for (const fs::path& place : entries_of(folder)) {
    if (!is_file(place / "data.csv")) continue;
    TopicSummary topic{.topic = place.filename().string(),
                       .type = "data.csv",
                       .has_sensor_stamps = true,
                       .is_image = place.filename().string().starts_with("cam")};
    const std::string text = read_input_file(place / "data.csv");
    for (const TextRow& row : split_rows(text)) {
      const auto stamp = parse_int64(row.fields.front());
      if (stamp) topic.stamps.push_back(*stamp);
    }
    topics.push_back(std::move(topic));
  }
  return topics;
}

TopicSummary image_topic(const std::string& name, const std::string& type) {
  return {.topic = name, .type = type, .has_sensor_stamps = true, .is_image = true};
}

// The streams of a folder in another layout than EuRoC's. The camera does not matter here.
std::vector<TopicSummary> folder_topics(const fs::path& folder, FolderLayout layout) {
  const bool is_stereo = layout == FolderLayout::kKitti;
  const ImageFolder found =
      layout == FolderLayout::kTum ? read_tum_folder(folder, {}) : read_folder(folder);
  std::vector<TopicSummary> topics = {
      image_topic(is_stereo ? "left" : "color", to_string(layout)),
      image_topic(is_stereo ? "right" : "depth", to_string(layout))};
  for (const StereoPairFile& frame : found.frames) {
    const auto add = [&](const fs::path& file, TopicSummary& topic) {
      if (is_file(file)) topic.stamps.push_back(frame.stamp);
    };
    add(frame.left, topics[0]);
    add(is_stereo ? frame.right : frame.depth, topics[1]);
  }
  return topics;
}

// The chosen topics, and the others of their kinds.
std::string rivals_text(const std::vector<TopicSummary>& topics, const RigFile& rig) {
  std::string text = "\nchosen:";
  const std::array chosen = {&rig.left.topic, &rig.right.topic,    &rig.depth.topic,
                             &rig.imu.topic,  &rig.imu.gyro_topic, &rig.imu.accel_topic};
  for (const std::string* topic : chosen)
    if (!topic->empty()) text += ' ' + readable(*topic, 80);
  std::string others;
  for (const TopicSummary& topic : topics) {
    const bool is_imu = is_of_type({topic.topic, topic.type, topic.encoding, 0}, RosImu::kType);
    const bool is_chosen =
        std::ranges::any_of(chosen, [&](const auto* one) { return *one == topic.topic; });
    if ((topic.is_image || is_imu) && !is_chosen && !topic.stamps.empty())
      others += ' ' + readable(topic.topic, 80);
  }
  return text + '\n' + (others.empty() ? "" : "not chosen:" + others + '\n');
}

// Writes the rig file that fits the topics best. Returns text on its content. `source`: the
// recording, or the live topics.
std::string write_rig(const std::vector<TopicSummary>& topics, const std::string& source,
                      const fs::path& rig) {
  const RigFile proposal = propose_rig(topics);
  if (proposal.left.topic.empty())
    throw InputFileError(rig.string() + ": not written: no camera: no topic of " + source +
                         " has images");
  write_file(rig, "# The sensors in " + source + ": see that they are the right ones.\n" +
                      rig_file_text(proposal));
  const bool has_infos = !proposal.left.info_topic.empty() &&
                         (proposal.right.topic.empty() || !proposal.right.info_topic.empty());
  const std::string problem = depth_problem(topics, proposal);
  return (problem.empty() ? "" : "\nwarning: " + problem + '\n') + rivals_text(topics, proposal) +
         "\nwritten: " + rig.string() + ": look at its topics, and name the calibration" +
         (has_infos ? "; without it, the calibration comes from topics of CameraInfo and from "
                      "/tf_static\n"
                    : "\n");
}

constexpr double kDiscovery_s = 10.0;  // longest time until a program publishes images
constexpr double kQuiet_s = 1.0;       // discovery is complete after this time without news
constexpr double kListen_s = 10.0;     // longest time to listen
constexpr std::size_t kEnough = 30;    // messages of each sensor
constexpr int kLiveMessages = 4000;    // kept messages of a topic

bool is_sensor(const BagChannel& channel) {
  return has_images(channel) || is_of_type(channel, RosImu::kType) ||
         is_of_type(channel, RosCameraInfo::kType);
}

// The live topics until each sensor has given enough messages.
class FirstMessages final : public BagReader {
 public:
  explicit FirstMessages(LiveBag& bag) : bag_(bag), counts_(bag.channels().size()) {}

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return bag_.channels(); }
  [[nodiscard]] std::optional<BagMessage> next() override {
    if (has_enough()) return std::nullopt;
    auto message = bag_.next();
    if (message) ++counts_[message->channel];
    return message;
  }
  [[nodiscard]] BagReport report() const override { return bag_.report(); }
  [[nodiscard]] bool is_live() const override { return true; }

 private:
  [[nodiscard]] bool has_enough() const {
    for (std::size_t k = 0; k < counts_.size(); ++k)
      if (is_sensor(channels()[k]) && counts_[k] < kEnough) return false;
    return true;
  }

  LiveBag& bag_;
  std::vector<std::size_t> counts_;
};

std::vector<RosTopic> topics_of(const std::vector<TopicPublisher>& publishers) {
  const auto known = known_ros_types();
  std::vector<RosTopic> topics;
  for (const TopicPublisher& publisher : publishers) {
    const bool is_new = std::ranges::count(topics, publisher.topic, &RosTopic::topic) == 0;
    if (is_new && std::ranges::count(known, publisher.type) > 0)
      topics.push_back({publisher.topic, publisher.type, RosQos::kSensorData, kLiveMessages});
  }
  return topics;
}

// Listens to ROS 2 for some seconds, and summarises the topics that programs publish there, of all
// types that RosNetwork knows.
std::vector<TopicSummary> summarise_live_topics(const RosConfig& config) {
  const auto network = std::make_shared<const RosNetwork>(config);
  const std::string place =
      "ROS domain " + std::to_string(config.domain) + ", interface " + network->interface();
  log::info("inspect") << "listening on " << place;
  RosDiscovery discovery(*network);
  const auto has_publishers_of_images = [&discovery] {
    return std::ranges::any_of(discovery.publishers(), [](const TopicPublisher& publisher) {
      return has_images({publisher.topic, publisher.type, "cdr", 0});
    });
  };
  const double end_s = steady_now_s() + kDiscovery_s;
  while (discovery.wait(kQuiet_s) || !has_publishers_of_images())
    if (steady_now_s() > end_s && !has_publishers_of_images())
      throw std::runtime_error("no program publishes images on " + place +
                               ": start the drivers; --set ros.domain=N is their ROS_DOMAIN_ID, "
                               "--set ros.interface=lo is for ROS_LOCALHOST_ONLY=1");
  LiveBag bag(network, topics_of(discovery.publishers()));
  bag.give_up_after(kListen_s);
  FirstMessages messages(bag);
  return summarise_topics(messages);
}

void refuse_existing(const fs::path& rig) {
  if (!is_absent(rig)) throw InputFileError(rig.string() + ": is there already: name another file");
}

bool is_depth(const TopicSummary& topic) {
  if (!topic.is_image) return false;
  const std::string encoding = topic.image ? topic.image->encoding : "";
  return encoding == "16UC1" || encoding == "32FC1" || has_word(topic, "depth");
}

// Parts of names that mark the left and the right camera.
constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kSides = {
    {{"left", "right"},
     {"infra1", "infra2"},
     {"infrared_1", "infrared_2"},
     {"cam0", "cam1"},
     {"cam_0", "cam_1"},
     {"camera0", "camera1"}}};

// True if the names of a left and a right camera are equal except for the side.
bool are_counterparts(const std::string& left, const std::string& right) {
  for (const auto& [from, to] : kSides) {
    std::string all = left;
    for (std::size_t at = all.find(from); at != all.npos; at = all.find(from, at + to.size()))
      all.replace(at, from.size(), to);
    if (all != left && all == right) return true;
    for (std::size_t at = left.find(from); at != left.npos; at = left.find(from, at + 1))
      if (std::string(left).replace(at, from.size(), to) == right) return true;
  }
  return false;
}

// 3: counterparts with rectified images; 2: counterparts; 1: a left and a right camera; 0: others.
int likeness_of_sides(const TopicSummary& left, const TopicSummary& right) {
  if (are_counterparts(lower(left.topic), lower(right.topic)))
    return has_word(left, "rect") ? 3 : 2;
  return std::ranges::any_of(kSides, [&](const auto& side) {
    return has_word(left, side.first) && has_word(right, side.second);
  });
}

const TopicSummary& named(const std::vector<TopicSummary>& topics, const std::string& name) {
  return *std::ranges::find(topics, name, &TopicSummary::topic);
}

// Prefers two cameras whose names are equal except for the side, so that they are of one device and
// one kind. Otherwise takes the pair with the most common stamps, in the order of their names.
void propose_stereo(const std::vector<TopicSummary>& topics, RigFile& rig) {
  std::pair<int, std::size_t> best;
  for (const TopicPair& pair : pairs_of_images(topics)) {
    const TopicSummary* left = &named(topics, pair.first);
    const TopicSummary* right = &named(topics, pair.second);
    if (is_depth(*left) || is_depth(*right)) continue;
    const int there = likeness_of_sides(*left, *right), back = likeness_of_sides(*right, *left);
    if (back > there || (back == there && right->topic < left->topic)) std::swap(left, right);
    const std::pair merit(std::max(there, back), 1 + pair.agreement.pairs);
    if (merit <= best) continue;
    best = merit;
    rig.left.topic = left->topic;
    rig.right.topic = right->topic;
  }
}

// True if the images may show the same pixels, see DepthAlignment.
bool may_be_aligned(const TopicSummary& camera, const TopicSummary& depth) {
  return !camera.image || !depth.image ||
         (different_size(*camera.image, *depth.image) +
          different_frame(*camera.image, *depth.image))
             .empty();
}

// Prefers a camera and depth that are aligned.
void propose_depth(const std::vector<TopicSummary>& topics, RigFile& rig) {
  for (const bool aligned : {true, false})
    for (const TopicSummary& depth : topics)
      for (const TopicSummary& camera : topics) {
        const bool is_camera = camera.is_image && !is_depth(camera) &&
                               (rig.left.topic.empty() || camera.topic == rig.left.topic);
        if (!rig.depth.topic.empty() || !is_depth(depth) || !is_camera) continue;
        if (depth.stamps.empty() || camera.stamps.empty()) continue;
        if (aligned && !may_be_aligned(camera, depth)) continue;
        rig.left.topic = camera.topic;
        rig.depth.topic = depth.topic;
      }
}

// Among several topics, takes the one that shares the longest prefix with the topic of the left
// camera ("/Alpha/..."), and of those the one at the highest rate.
void propose_imu(const std::vector<TopicSummary>& topics, RigFile& rig) {
  const auto likeness = [&](const std::string& topic) {
    const std::string& left = rig.left.topic;
    const auto end = std::ranges::mismatch(left, topic).in1;
    return std::pair(std::ranges::count(left.begin(), end, '/'),
                     named(topics, topic).stamps.size());
  };
  for (const TopicSummary& topic : topics) {
    const bool is_imu = is_of_type({topic.topic, topic.type, topic.encoding, 0}, RosImu::kType);
    if (!is_imu || topic.stamps.empty()) continue;
    std::string& place = has_word(topic, "gyro")    ? rig.imu.gyro_topic
                         : has_word(topic, "accel") ? rig.imu.accel_topic
                                                    : rig.imu.topic;
    if (place.empty() || likeness(topic.topic) > likeness(place)) place = topic.topic;
  }
  if (!rig.imu.topic.empty()) rig.imu.gyro_topic = rig.imu.accel_topic = "";
}

// Topic on which a driver publishes the CameraInfo of these images; empty if there is none.
void propose_info(const std::vector<TopicSummary>& topics, RigFile::Camera& camera) {
  const std::string beside = camera_info_beside(camera.topic);
  const bool is_there = std::ranges::any_of(topics, [&beside](const TopicSummary& topic) {
    return topic.topic == beside && !topic.stamps.empty() &&
           is_of_type({topic.topic, topic.type, topic.encoding, 0}, RosCameraInfo::kType);
  });
  if (is_there && !camera.topic.empty()) camera.info_topic = beside;
}

}  // namespace

std::string inspect_recording(const fs::path& path) {
  if (is_folder(path) && !may_be_bag(path)) {
    if (const FolderLayout layout = layout_of(path); layout != FolderLayout::kEuroc)
      return text_of(folder_topics(path, layout));
    const auto topics = euroc_topics(is_folder(path / "mav0") ? path / "mav0" : path);
    if (topics.empty())
      throw InputFileError(path.string() + ": neither .db3 or .mcap files nor a recording in " +
                           kKnownLayouts);
    return text_of(topics);
  }
  const auto reader = open_bag(path);
  const std::string text = text_of(summarise_topics(*reader));
  return text + to_string(reader->report());
}

std::string inspect_recording(const fs::path& path, const fs::path& rig) {
  refuse_existing(rig);
  if (is_folder(path) && !may_be_bag(path) && layout_of(path) != FolderLayout::kEuroc)
    throw InputFileError(rig.string() + ": not written: " + path.string() + " is " +
                         to_string(layout_of(path)) +
                         ", which needs no topics; play it with "
                         "--dataset " +
                         path.string());
  if (is_folder(path / "mav0") || is_folder(path / "cam0"))
    throw InputFileError(rig.string() + ": not written: " + path.string() +
                         " is a EuRoC folder, whose calibration is its own sensor.yaml files; play "
                         "it with --dataset " +
                         path.string() + ", without --rig");
  const auto reader = open_bag(path);
  const auto topics = summarise_topics(*reader);
  return text_of(topics) + to_string(reader->report()) + write_rig(topics, path.string(), rig);
}

std::string inspect_live(const RosConfig& config, const fs::path& rig) {
  if (rig.empty()) return text_of(summarise_live_topics(config));
  refuse_existing(rig);
  const auto topics = summarise_live_topics(config);
  return text_of(topics) + write_rig(topics, "ROS domain " + std::to_string(config.domain), rig);
}

RigFile propose_rig(const std::vector<TopicSummary>& topics) {
  RigFile rig;
  propose_stereo(topics, rig);
  propose_depth(topics, rig);
  propose_imu(topics, rig);
  propose_info(topics, rig.left);
  propose_info(topics, rig.right);
  return rig;
}

std::string depth_problem(const std::vector<TopicSummary>& topics, const RigFile& rig) {
  if (rig.depth.topic.empty() || !rig.right.topic.empty()) return "";
  const TopicSummary &left = named(topics, rig.left.topic), &depth = named(topics, rig.depth.topic);
  if (may_be_aligned(left, depth)) return "";
  const std::string size = different_size(*left.image, *depth.image);
  return misaligned_text(left.topic, depth.topic,
                         size.empty() ? different_frame(*left.image, *depth.image) : size);
}

}  // namespace km
