#include "apps/publish/message_player.hpp"

#include <algorithm>
#include <deque>
#include <stdexcept>
#include <utility>

#include "modules/core/io/bytes.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/sensor_messages.hpp"

namespace km {
namespace {

constexpr const char* kLeft = "/cam0/image_raw";
constexpr const char* kRight = "/cam1/image_raw";
constexpr const char* kDepth = "/depth0/image_raw";
constexpr const char* kImu = "/imu0";
constexpr const char* kImageType = "sensor_msgs/msg/Image";

RosImage message_of(Stamp stamp, const GrayImage& image, const char* frame) {
  return {.header = {stamp, frame},
          .height = static_cast<std::uint32_t>(image.height),
          .width = static_cast<std::uint32_t>(image.width),
          .encoding = "mono8",
          .is_bigendian = 0,
          .step = static_cast<std::uint32_t>(image.width),
          .data = image.pixels};
}

RosImage message_of(Stamp stamp, const DepthImage& image) {
  RosImage message{.header = {stamp, "cam0"},
                   .height = static_cast<std::uint32_t>(image.height),
                   .width = static_cast<std::uint32_t>(image.width),
                   .encoding = "16UC1",
                   .is_bigendian = 0,
                   .step = static_cast<std::uint32_t>(2 * image.width),
                   .data = {}};
  ByteWriter data;
  for (const std::uint16_t value : image.millimetres) data.u16(value);
  message.data = data.release();
  return message;
}

RosImu message_of(const ImuSample& sample) {
  RosImu message;
  message.header = {sample.stamp, "imu0"};
  message.orientation_covariance[0] = -1.0;  // no orientation is measured
  message.angular_velocity = sample.gyro;
  message.linear_acceleration = sample.accel;
  return message;
}

class EurocMessages final : public BagReader {
 public:
  explicit EurocMessages(std::unique_ptr<DatasetReader> dataset) : dataset_(std::move(dataset)) {
    const SensorRig& rig = dataset_->rig();
    channels_ = {{kImu, "sensor_msgs/msg/Imu", "cdr", 0}, {kLeft, kImageType, "cdr", 0}};
    if (rig.stereo.depth_source == DepthSource::kRightImage)
      channels_.push_back({kRight, kImageType, "cdr", 0});
    if (rig.depth) channels_.push_back({kDepth, kImageType, "cdr", 0});
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  [[nodiscard]] BagReport report() const override { return {}; }
  [[nodiscard]] std::optional<BagMessage> next() override {
    while (messages_.empty()) {
      const auto packet = dataset_->next();
      if (!packet) return std::nullopt;
      take(*packet);
    }
    BagMessage message = std::move(messages_.front());
    messages_.pop_front();
    return message;
  }

 private:
  void add(const char* topic, Stamp stamp, std::vector<std::uint8_t> bytes) {
    const auto channel = std::ranges::find(channels_, topic, &BagChannel::topic);
    messages_.push_back(
        {static_cast<std::size_t>(channel - channels_.begin()), stamp, std::move(bytes)});
  }

  // Adds the samples of a packet, and its frame before the last sample, because only this sample
  // can be later than the frame.
  void take(const SensorPacket& packet) {
    const StereoFrame& frame = *packet.frame;
    const auto add_frame = [&] {
      add(kLeft, frame.stamp, encode_ros(message_of(frame.stamp, frame.left, "cam0")));
      if (!frame.right.pixels.empty())
        add(kRight, frame.stamp, encode_ros(message_of(frame.stamp, frame.right, "cam1")));
      if (frame.depth) add(kDepth, frame.stamp, encode_ros(message_of(frame.stamp, *frame.depth)));
    };
    for (std::size_t k = 0; k < packet.imu.size(); ++k) {
      const ImuSample& sample = packet.imu[k];
      if (k + 1 == packet.imu.size()) add_frame();
      if (last_sample_ && sample.stamp <= *last_sample_) continue;
      last_sample_ = sample.stamp;
      add(kImu, sample.stamp, encode_ros(message_of(sample)));
    }
  }

  std::unique_ptr<DatasetReader> dataset_;
  std::vector<BagChannel> channels_;
  std::deque<BagMessage> messages_;
  std::optional<Stamp> last_sample_;
};

class FixMessages final : public BagReader {
 public:
  FixMessages(std::unique_ptr<BagReader> recording, std::vector<ReceivedFix> fixes,
              const std::string& topic, const std::string& type)
      : recording_(std::move(recording)),
        fixes_(std::move(fixes)),
        channels_(recording_->channels()) {
    if (std::ranges::find(channels_, topic, &BagChannel::topic) != channels_.end())
      throw std::invalid_argument("the recording has a topic " + topic +
                                  ": give another one with --fix-topic");
    channels_.push_back({topic, type, "cdr", 0});
    std::ranges::stable_sort(fixes_, {}, &ReceivedFix::stamp);
  }

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  [[nodiscard]] BagReport report() const override { return recording_->report(); }
  [[nodiscard]] std::optional<BagMessage> next() override {
    if (!next_) next_ = recording_->next();
    if (!next_) return std::nullopt;
    while (!began_ && next_fix_ < fixes_.size() && fixes_[next_fix_].stamp < next_->log_time)
      ++next_fix_;
    began_ = true;
    if (next_fix_ < fixes_.size() && fixes_[next_fix_].stamp < next_->log_time)
      return message_of(fixes_[next_fix_++]);
    return std::exchange(next_, std::nullopt);
  }

 private:
  [[nodiscard]] BagMessage message_of(const ReceivedFix& fix) const {
    const auto message = [&](const auto& content) {
      return BagMessage{channels_.size() - 1, fix.stamp, encode_ros(content)};
    };
    const Eigen::Vector3d& p = fix.coordinates;
    if (channels_.back().type == kMotionCaptureType) {
      RosPoseStamped pose;
      pose.header.stamp = fix.stamp;
      pose.pose.position = p;
      return message(pose);
    }
    return message(RosNavSatFix{
        .header = {fix.stamp, "gps"}, .latitude = p.x(), .longitude = p.y(), .altitude = p.z()});
  }

  std::unique_ptr<BagReader> recording_;
  std::vector<ReceivedFix> fixes_;  // ascending stamps
  std::vector<BagChannel> channels_;
  std::size_t next_fix_ = 0;
  std::optional<BagMessage> next_;  // message of the recording
  bool began_ = false;
};

constexpr int kKeptMessages = 100;
constexpr const char* kLatchedTopic = "/tf_static";

template <typename... Messages>
std::optional<std::vector<std::uint8_t>> as_ros_2(const BagChannel& channel,
                                                  const std::vector<std::uint8_t>& bytes) {
  std::optional<std::vector<std::uint8_t>> written;
  const auto rewrite = [&]<typename Message>(const Message*) {
    if (!is_of_type(channel, Message::kType)) return;
    const auto message = decode_ros<Message>(channel.encoding, bytes);
    if (message.value) written = encode_ros(*message.value);
  };
  (rewrite(static_cast<const Messages*>(nullptr)), ...);
  return written;
}

// The message as little-endian CDR; nullopt if the bytes are no message of the channel's type.
std::optional<std::vector<std::uint8_t>> as_published(const BagChannel& channel,
                                                      std::vector<std::uint8_t> bytes) {
  constexpr std::uint8_t kLittleEndian = 1;
  if (channel.encoding == "cdr" && bytes.size() > 4 && bytes[1] == kLittleEndian) return bytes;
  return as_ros_2<RosImage, RosCompressedImage, RosImu, RosCameraInfo, RosNavSatFix, RosPoseStamped,
                  RosPoseWithCovarianceStamped, RosTransformStamped, RosOdometry, RosPath,
                  RosTFMessage, RosPointCloud2, RosDiagnosticArray>(channel, bytes);
}

bool is_known(const BagChannel& channel) {
  const auto types = known_ros_types();
  return (channel.encoding == "cdr" || channel.encoding == "ros1") &&
         std::ranges::any_of(types, [&](std::string type) {
           type.erase(type.find("/msg"), 4);
           return is_of_type(channel, type);
         });
}

}  // namespace

std::unique_ptr<BagReader> euroc_messages(std::unique_ptr<DatasetReader> dataset) {
  return std::make_unique<EurocMessages>(std::move(dataset));
}

std::unique_ptr<BagReader> with_fixes(std::unique_ptr<BagReader> recording,
                                      std::vector<ReceivedFix> fixes, const std::string& topic,
                                      const std::string& type) {
  return std::make_unique<FixMessages>(std::move(recording), std::move(fixes), topic, type);
}

MessagePlayer::MessagePlayer(std::unique_ptr<BagReader> recording,
                             const std::shared_ptr<const RosNetwork>& network,
                             const PlayOptions& options)
    : recording_(std::move(recording)),
      options_(options),
      random_(options.seed),
      clock_(options.rate) {
  for (const BagChannel& channel : recording_->channels()) {
    const bool is_wanted = options.topics.empty() ||
                           std::ranges::find(options.topics, channel.topic) != options.topics.end();
    topic_of_.emplace_back();
    if (!is_wanted) continue;
    if (!is_known(channel)) {
      left_out_.push_back(channel.topic + " (" + channel.type + ")");
      continue;
    }
    const auto known = std::ranges::find(topics_, channel.topic, &PlayedTopic::topic);
    topic_of_.back() = static_cast<std::size_t>(known - topics_.begin());
    if (known != topics_.end()) continue;
    topics_.push_back({channel.topic, channel.type});
    const RosQos qos = channel.topic == kLatchedTopic ? RosQos::kLatched
                       : options.reliable             ? RosQos::kReliable
                                                      : RosQos::kSensorData;
    const std::string type =
        is_of_type(channel, RosTFMessage::kType) ? std::string(RosTFMessage::kType) : channel.type;
    publishers_.push_back(
        std::make_unique<RosPublisher>(network, channel.topic, type, qos, kKeptMessages));
  }
  for (const std::string& topic : options.topics)
    if (std::ranges::find(recording_->channels(), topic, &BagChannel::topic) ==
        recording_->channels().end())
      throw std::invalid_argument("the recording has no topic " + readable(topic, 80));
}

std::vector<std::string> MessagePlayer::topics_short_of(std::size_t readers) const {
  std::vector<std::string> topics;
  for (std::size_t k = 0; k < publishers_.size(); ++k) {
    const BagChannel channel{topics_[k].topic, topics_[k].type, "cdr", 0};
    const bool is_sensor = has_images(channel) || is_of_type(channel, RosImu::kType);
    if (is_sensor && publishers_[k]->reader_count() < readers) topics.push_back(channel.topic);
  }
  return topics;
}

// Schedules a message; false after the end of the part to play.
bool MessagePlayer::take(BagMessage message) {
  const Stamp begin = first_.value_or(message.log_time) + nanoseconds(options_.from_s);
  if (!first_) {
    first_ = message.log_time;
    static_cast<void>(clock_.due(begin, ReplayClock::TimePoint::clock::now()));
  }
  if (seconds_between(*first_, message.log_time) >= options_.to_s) return false;
  const bool is_latched = recording_->channels()[message.channel].topic == kLatchedTopic;
  if (message.log_time < begin && !is_latched) return true;
  message.log_time = std::max(message.log_time, begin);
  schedule(std::move(message));
  return true;
}

void MessagePlayer::schedule(BagMessage message) {
  newest_ = std::max(newest_.value_or(message.log_time), message.log_time);
  if (message.channel >= topic_of_.size() || !topic_of_[message.channel]) return;
  const std::size_t topic = *topic_of_[message.channel];
  std::uniform_real_distribution<double> uniform;
  if (uniform(random_) < options_.drop_share) {
    ++topics_[topic].dropped;
    return;
  }
  auto bytes = as_published(recording_->channels()[message.channel], std::move(message.bytes));
  if (!bytes) {
    ++topics_[topic].refused;
    return;
  }
  // Delay in the time of the recording, in which clock_ counts.
  const double delay_s = options_.rate * options_.jitter_s * uniform(random_);
  due_.push({message.log_time + nanoseconds(delay_s), number_++, topic, std::move(*bytes)});
}

bool MessagePlayer::step() {
  while (!ended_ && (due_.empty() || *newest_ <= due_.top().stamp)) {
    auto message = recording_->next();
    ended_ = !message || !take(std::move(*message));
  }
  if (due_.empty() || !clock_.wait_until(due_.top().stamp)) return false;
  const Due& due = due_.top();
  publishers_[due.topic]->publish(due.bytes);
  ++topics_[due.topic].published;
  played_s_ = seconds_between(*first_, due.stamp);
  due_.pop();
  return true;
}

}  // namespace km
