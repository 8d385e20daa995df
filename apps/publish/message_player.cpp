#include "apps/publish/message_player.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "modules/core/text_rows.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/sensor_messages.hpp"

namespace km {
namespace {

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
  const double delay_s = options_.rate * (options_.delay_s + options_.jitter_s * uniform(random_));
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
