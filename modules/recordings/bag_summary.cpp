#include "modules/recordings/bag_summary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string_view>

#include "modules/core/quantile.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {
namespace {

// Types that begin with a header. In geometry_msgs, types whose name ends in "Stamped" have one.
constexpr std::array<std::string_view, 20> kTypesWithHeader = {
    RosImage::kType,
    RosCompressedImage::kType,
    RosImu::kType,
    RosCameraInfo::kType,
    RosOdometry::kType,
    "nav_msgs/Path",
    RosOccupancyGrid::kType,
    "sensor_msgs/PointCloud",
    "sensor_msgs/PointCloud2",
    "sensor_msgs/LaserScan",
    "sensor_msgs/NavSatFix",
    "sensor_msgs/MagneticField",
    "sensor_msgs/FluidPressure",
    "sensor_msgs/Temperature",
    "sensor_msgs/Range",
    "sensor_msgs/JointState",
    "sensor_msgs/Joy",
    "sensor_msgs/TimeReference",
    "sensor_msgs/BatteryState",
    "sensor_msgs/RelativeHumidity",
};

bool has_header(const BagChannel& channel) {
  if (channel.type.starts_with("geometry_msgs/") && channel.type.ends_with("Stamped")) return true;
  return std::any_of(kTypesWithHeader.begin(), kTypesWithHeader.end(),
                     [&](std::string_view type) { return is_of_type(channel, type); });
}

// Stamp of a message; nullopt if the message is not of its type.
std::optional<Stamp> stamp_in(const BagChannel& channel, const BagMessage& message) {
  if (is_of_type(channel, RosTFMessage::kType)) {
    const auto tree = decode_ros<RosTFMessage>(channel.encoding, message.bytes);
    if (!tree.value) return std::nullopt;
    const auto& transforms = tree.value->transforms;
    return transforms.empty() ? message.log_time : transforms.front().header.stamp;
  }
  const auto header = decode_ros<RosHeader>(channel.encoding, message.bytes);
  return header.value ? std::optional(header.value->stamp) : std::nullopt;
}

TopicSummary begin_topic(const BagChannel& channel) {
  const bool is_readable = channel.encoding == "ros1" || channel.encoding == "cdr";
  const bool is_stamped = has_header(channel) || is_of_type(channel, RosTFMessage::kType);
  return {.topic = channel.topic,
          .type = channel.type,
          .encoding = channel.encoding,
          .has_sensor_stamps = is_readable && is_stamped,
          .stamps = {},
          .is_image = is_readable && (is_of_type(channel, RosImage::kType) ||
                                      is_of_type(channel, RosCompressedImage::kType)),
          .image = {}};
}

void add_message(TopicSummary& topic, const BagChannel& channel, const BagMessage& message) {
  const auto stamp =
      topic.has_sensor_stamps ? stamp_in(channel, message) : std::optional(message.log_time);
  if (!stamp) {
    ++topic.undecoded;
    return;
  }
  topic.stamps.push_back(*stamp);
  if (topic.is_image && !topic.image) topic.image = topic_image(channel, message);
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// seconds_between() for arbitrary stamps, whose difference may overflow a Stamp.
double seconds_from_to(Stamp a, Stamp b) {
  const auto difference =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(b) - static_cast<std::uint64_t>(a));
  const bool overflows = (difference < 0) != (b < a);
  return overflows ? (static_cast<double>(b) - static_cast<double>(a)) * 1e-9
                   : static_cast<double>(difference) * 1e-9;
}

// Index of the stamp nearest to `stamp`. `stamps` are sorted and not empty.
std::size_t nearest(std::span<const Stamp> stamps, Stamp stamp) {
  const auto after = std::lower_bound(stamps.begin(), stamps.end(), stamp);
  const auto index = static_cast<std::size_t>(after - stamps.begin());
  if (after == stamps.begin()) return 0;
  if (after == stamps.end()) return index - 1;
  return seconds_from_to(stamps[index - 1], stamp) < seconds_from_to(stamp, *after) ? index - 1
                                                                                    : index;
}

}  // namespace

std::optional<TopicImage> topic_image(const BagChannel& channel, const BagMessage& message) {
  if (is_of_type(channel, RosImage::kType)) {
    const auto image = decode_ros<RosImage>(channel.encoding, message.bytes);
    if (!image.value) return std::nullopt;
    return TopicImage{{image.value->width, image.value->height},
                      image.value->encoding,
                      image.value->header.frame_id};
  }
  const auto image = decode_ros<RosCompressedImage>(channel.encoding, message.bytes);
  if (!image.value) return std::nullopt;
  const auto& data = image.value->data;
  const auto size = stated_image_size({reinterpret_cast<const char*>(data.data()), data.size()});
  return TopicImage{size.value_or(ImageSize{}), image.value->format, image.value->header.frame_id};
}

std::vector<TopicSummary> summarise_topics(BagReader& reader) {
  ChannelTable table;
  std::vector<std::size_t> topic_of;
  std::vector<TopicSummary> topics;
  const auto add_channels = [&] {
    for (std::size_t i = topic_of.size(); i < reader.channels().size(); ++i) {
      topic_of.push_back(table.add(reader.channels()[i]));
      if (topic_of.back() == topics.size()) topics.push_back(begin_topic(reader.channels()[i]));
    }
  };
  add_channels();
  while (const auto message = reader.next()) {
    add_channels();
    add_message(topics[topic_of[message->channel]], reader.channels()[message->channel], *message);
  }
  return topics;
}

std::vector<TopicPair> pairs_of_images(const std::vector<TopicSummary>& topics) {
  struct Candidate {
    const TopicSummary* topic;
    double rate_hz;
    std::vector<Stamp> sorted;
  };
  std::vector<Candidate> candidates;
  for (const TopicSummary& topic : topics) {
    const double rate_hz = stamp_statistics(topic.stamps).rate_hz;
    if (!topic.is_image || !std::isfinite(rate_hz)) continue;
    candidates.push_back({&topic, rate_hz, topic.stamps});
    std::sort(candidates.back().sorted.begin(), candidates.back().sorted.end());
  }
  constexpr double kEqualRates = 0.05;
  std::vector<TopicPair> pairs;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    for (std::size_t j = i + 1; j < candidates.size(); ++j) {
      const Candidate &a = candidates[i], &b = candidates[j];
      const double fastest_hz = std::max(a.rate_hz, b.rate_hz);
      if (std::abs(a.rate_hz - b.rate_hz) > kEqualRates * fastest_hz) continue;
      pairs.push_back(
          {a.topic->topic, b.topic->topic, stamp_agreement(a.sorted, b.sorted, 0.5 / fastest_hz)});
    }
  return pairs;
}

StampStatistics stamp_statistics(std::vector<Stamp> stamps) {
  StampStatistics result{.count = stamps.size(),
                         .rate_hz = kNone,
                         .largest_gap_s = kNone,
                         .median_s = kNone,
                         .jitter_s = kNone};
  for (std::size_t i = 1; i < stamps.size(); ++i)
    result.unordered += stamps[i] <= stamps[i - 1] ? 1 : 0;
  std::sort(stamps.begin(), stamps.end());
  if (stamps.empty()) return result;
  result.first = stamps.front();
  result.last = stamps.back();
  if (stamps.size() < 2) return result;
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    intervals_s.push_back(seconds_from_to(stamps[i - 1], stamps[i]));
  const double total_s = seconds_from_to(result.first, result.last);
  if (total_s > 0.0) result.rate_hz = static_cast<double>(intervals_s.size()) / total_s;
  const auto largest = std::max_element(intervals_s.begin(), intervals_s.end());
  result.largest_gap_s = *largest;
  result.gap_from = stamps[static_cast<std::size_t>(largest - intervals_s.begin())];
  result.median_s = quantile(intervals_s, 0.5);
  for (double& interval_s : intervals_s) interval_s = std::abs(interval_s - result.median_s);
  result.jitter_s = quantile(std::move(intervals_s), 0.95);
  return result;
}

StampAgreement stamp_agreement(std::span<const Stamp> first, std::span<const Stamp> second,
                               double tolerance_s) {
  StampAgreement result{.median_offset_s = kNone, .largest_deviation_s = kNone};
  std::vector<double> offsets_s;
  for (std::size_t i = 0; i < first.size() && !second.empty(); ++i) {
    const std::size_t other = nearest(second, first[i]);
    const double offset_s = seconds_from_to(first[i], second[other]);
    if (nearest(first, second[other]) != i || std::abs(offset_s) > tolerance_s) continue;
    offsets_s.push_back(offset_s);
    result.equal += first[i] == second[other] ? 1 : 0;
  }
  result.pairs = offsets_s.size();
  result.only_first = first.size() - result.pairs;
  result.only_second = second.size() - result.pairs;
  if (offsets_s.empty()) return result;
  result.median_offset_s = quantile(offsets_s, 0.5);
  result.largest_deviation_s = 0.0;
  for (const double offset_s : offsets_s)
    result.largest_deviation_s =
        std::max(result.largest_deviation_s, std::abs(offset_s - result.median_offset_s));
  return result;
}

}  // namespace km
