#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <vector>

#include "modules/core/data/received_fix.hpp"
#include "modules/recordings/bag_reader.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "runtime/clock.hpp"
#include "runtime/ros/ros_publisher.hpp"

namespace km {

/// Message types of fixes: for GNSS and for a motion capture.
inline constexpr const char* kGnssType = "sensor_msgs/msg/NavSatFix";
inline constexpr const char* kMotionCaptureType = "geometry_msgs/msg/PoseStamped";

/// A EuRoC recording as the messages of its drivers: sensor_msgs/Image on /cam0/image_raw and
/// /cam1/image_raw, or /depth0/image_raw, and sensor_msgs/Imu on /imu0. They are logged at their
/// stamps.
[[nodiscard]] std::unique_ptr<BagReader> euroc_messages(std::unique_ptr<DatasetReader> dataset);

/// A recording with one more topic, of absolute fixes. They are logged at their stamps; those
/// before the first and after the last message of the recording are left out. `type` is one of the
/// message types above. Throws std::invalid_argument if the recording has `topic` already.
[[nodiscard]] std::unique_ptr<BagReader> with_fixes(std::unique_ptr<BagReader> recording,
                                                    std::vector<ReceivedFix> fixes,
                                                    const std::string& topic,
                                                    const std::string& type);

/// Parameters of the playback, with errors of the transmission.
struct PlayOptions {
  double rate = 1.0;        ///< Times real time.
  double jitter_s = 0.0;    ///< Delay of each message, uniform from 0 to this.
  double drop_share = 0.0;  ///< Share of the messages that are dropped.
  bool reliable = false;    ///< False: best effort, as drivers of sensors are.
  unsigned seed = 0;
  std::vector<std::string> topics = {};  ///< Topics to play; empty: all.
  /// Part to play [s since the first message]; of earlier messages only latched ones are published.
  double from_s = 0.0, to_s = std::numeric_limits<double>::infinity();
};

/// Statistics of one topic.
struct PlayedTopic {
  std::string topic, type;
  std::size_t published = 0;
  std::size_t dropped = 0;
  std::size_t refused = 0;  ///< Messages with invalid content.
};

/// Publishes the messages of a recording as live topics of ROS 2, as recorded or with errors.
/// Messages of ROS 1 are converted to ROS 2.
class MessagePlayer {
 public:
  /// Topics with types unknown to RosNetwork are not played, see unsupported_topics(). Throws
  /// std::invalid_argument for topics to play that the recording does not have.
  MessagePlayer(std::unique_ptr<BagReader> recording,
                const std::shared_ptr<const RosNetwork>& network, const PlayOptions& options);

  /// The topics of images and inertial samples with fewer than `readers` readers. Not every robot
  /// reads the other topics of a recording.
  [[nodiscard]] std::vector<std::string> topics_short_of(std::size_t readers) const;

  /// Publishes the next message when it is due; false after the last one, and after stop().
  bool step();

  /// Ends step(). Thread-safe.
  void stop() { clock_.stop(); }

  [[nodiscard]] const std::vector<PlayedTopic>& topics() const { return topics_; }
  [[nodiscard]] const std::vector<std::string>& unsupported_topics() const { return left_out_; }
  /// Time of the last published message, in the recording's time since its first message.
  [[nodiscard]] double played_s() const { return played_s_; }

 private:
  struct Due {
    Stamp stamp = 0;
    std::uint64_t number = 0;  // index in the order of the recording
    std::size_t topic = 0;
    std::vector<std::uint8_t> bytes;
    bool operator>(const Due& other) const {
      return std::pair(stamp, number) > std::pair(other.stamp, other.number);
    }
  };

  [[nodiscard]] bool take(BagMessage message);
  void schedule(BagMessage message);

  std::unique_ptr<BagReader> recording_;
  PlayOptions options_;
  std::mt19937 random_;
  ReplayClock clock_;
  std::vector<PlayedTopic> topics_;
  std::vector<std::unique_ptr<RosPublisher>> publishers_;
  std::vector<std::optional<std::size_t>> topic_of_;  // topic of each channel; none if not played
  std::vector<std::string> left_out_;
  std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
  std::optional<Stamp> first_, newest_;
  bool ended_ = false;
  std::uint64_t number_ = 0;
  double played_s_ = 0.0;
};

}  // namespace km
