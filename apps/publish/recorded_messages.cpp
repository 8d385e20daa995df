#include "apps/publish/recorded_messages.hpp"

#include <algorithm>
#include <deque>
#include <optional>
#include <stdexcept>
#include <utility>

#include "modules/core/bytes.hpp"
#include "modules/recordings/ros_messages.hpp"

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

}  // namespace

std::unique_ptr<BagReader> euroc_messages(std::unique_ptr<DatasetReader> dataset) {
  return std::make_unique<EurocMessages>(std::move(dataset));
}

std::unique_ptr<BagReader> with_fixes(std::unique_ptr<BagReader> recording,
                                      std::vector<ReceivedFix> fixes, const std::string& topic,
                                      const std::string& type) {
  return std::make_unique<FixMessages>(std::move(recording), std::move(fixes), topic, type);
}

}  // namespace km
