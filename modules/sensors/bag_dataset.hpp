#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/sample_streams.hpp"
#include "modules/sensors/sensor_messages.hpp"
#include "modules/sensors/stream_stamps.hpp"

namespace km {

/// The messages with the images of one instant.
struct JoinedFrame {
  Stamp stamp = 0;  ///< Stamp of the left image.
  BagMessage left;
  std::optional<BagMessage> right, depth;
};

/// Joins streams of images into frames by their stamps, as they arrive. A frame has a left image, a
/// right image if there is a right camera, and a depth image if there is one for this instant.
///
/// The first kSample images of each stream are held back until the difference of their stamps is
/// known. From then on a left image waits for images of the other streams, until a later image of
/// the stream arrives or the log time has advanced by kPatience_s. Images without a partner are
/// counted.
class FrameJoiner {
 public:
  static constexpr std::size_t kSample = 20;
  static constexpr double kPatience_s = 1.0;
  static constexpr std::size_t kMaxHeld = 200;  ///< Largest number of images held per stream.

  FrameJoiner(bool has_right, bool has_depth);

  /// Adds an image of a camera or a depth sensor. Precondition: the stamps of each role ascend.
  void add(SensorRole role, Stamp stamp, BagMessage message);

  /// The next complete frame; nullopt if none is complete.
  [[nodiscard]] std::optional<JoinedFrame> next();

  /// Notes that no further image will come. Frames then wait no longer.
  void finish() { finished_ = true; }

  /// Counts of the images that belong to no frame.
  [[nodiscard]] const ReaderReport& report() const { return report_; }

  /// Synchrony of the right and of the depth images; nullopt until known, or without the stream.
  [[nodiscard]] std::optional<Synchrony> synchrony(SensorRole role) const {
    return streams_.at(static_cast<std::size_t>(role)).synchrony;
  }

 private:
  struct Held {
    Stamp stamp = 0;
    BagMessage message;
  };
  struct Stream {
    std::deque<Held> images;
    bool exists = false;
    std::optional<Synchrony> synchrony = {};
  };
  enum class Partner { kThere, kNone, kMayCome };

  [[nodiscard]] const std::deque<Held>& left() const { return streams_[0].images; }
  void drop_oldest(SensorRole role);
  [[nodiscard]] Stream& stream_of(SensorRole role) {
    return streams_.at(static_cast<std::size_t>(role));
  }
  [[nodiscard]] bool knows_synchrony();
  [[nodiscard]] bool has_waited() const;
  [[nodiscard]] Partner find_partner(SensorRole role);

  std::array<Stream, 3> streams_;  // kLeft, kRight, kDepth
  ReaderReport report_;
  Stamp newest_log_time_ = 0;
  bool finished_ = false;
};

/// Topics and calibration of the sensors in a recording.
struct Rig {
  SensorTopicNames topics;
  SensorRig sensors;
  double depth_scale_m = 1e-3;          ///< Depth of one unit in depth images of 16 bits [m].
  double camera_time_offset_s = 0.0;    ///< Added to the stamps of images to get the IMU's time.
  SE3 T_child_body = SE3::Identity();   ///< Pose of the body in the odometry's child frame.
  std::vector<std::string> notes = {};  ///< Remarks on the calibration, one line each.
};

/// Reads sensor packets from the messages of a bag as they arrive: sensor_msgs/Image and
/// CompressedImage, sensor_msgs/Imu and nav_msgs/Odometry. Stamps are those of the headers. Bad
/// messages are skipped and counted. A bag may be live.
class BagDataset final : public DatasetReader {
 public:
  /// `name`: path of the bag, with which messages begin.
  /// Reads up to the first packet unless the bag is live. Throws DatasetError if a topic is missing
  /// or of another type, and lists the existing topics. Throws DatasetError also if the window has
  /// no frame, and std::invalid_argument for a window that RecordingPart::check() refuses.
  BagDataset(std::string name, std::unique_ptr<BagReader> bag, Rig rig,
             const RecordingPart& window = {});

  [[nodiscard]] const SensorRig& rig() const override { return rig_.sensors; }
  using DatasetReader::next;
  [[nodiscard]] std::optional<SensorPacket> next(const ChooseUse& choose) override;
  [[nodiscard]] ReaderReport report() const override;
  [[nodiscard]] std::size_t pair_count() const override { return pair_count_; }
  [[nodiscard]] std::vector<std::string> remarks() const override;
  [[nodiscard]] bool gives_poses() const override { return !rig_.topics.odometry.empty(); }
  [[nodiscard]] bool is_live() const override { return bag_->is_live(); }
  void stop() noexcept override { bag_->stop(); }

 private:
  [[noreturn]] void refuse(std::string problem) const;
  void find_topics();
  void assign(const SensorTopic& wanted);
  [[nodiscard]] bool read_message();
  // A message whose stamp is not good: wrong, or among the first ones of a clock that was set. The
  // next good stamp of its stream decides.
  struct Doubtful {
    Stamp stated = 0;
    StampVerdict verdict = StampVerdict::kJump;
    BagMessage message;
  };
  void reject(SensorRole role, const Doubtful& one);
  void take(SensorRole role, BagMessage message);
  void take_stamped(SensorRole role, Stamp stamp, BagMessage message);
  void take_imu(SensorRole role, Stamp stamp, const BagMessage& message);
  void take_pose(Stamp stamp, const BagMessage& message);
  [[nodiscard]] std::optional<JoinedFrame> next_frame();
  [[nodiscard]] bool has_imu() const;
  [[nodiscard]] bool has_motion(const JoinedFrame& frame);
  [[nodiscard]] std::optional<StereoFrame> decode(const JoinedFrame& joined, FrameUse use);
  [[nodiscard]] std::optional<SensorPacket> read_packet(const ChooseUse& choose);
  [[nodiscard]] std::string place_of(const BagMessage& message) const;

  std::string name_;
  std::unique_ptr<BagReader> bag_;
  Rig rig_;
  RecordingPart window_;
  std::vector<const SensorKind*> kind_of_;  // by channel; null: not read
  ContinuousTime time_{kSensorKinds.size()};
  std::array<StampOrder, kSensorKinds.size()> order_;
  std::array<std::deque<Doubtful>, kSensorKinds.size()> doubtful_;  // at most kNewTimes
  std::array<MissingImages, kSensorKinds.size()> missing_;
  std::array<std::size_t, kSensorKinds.size()> taken_ = {};  // number of messages
  FrameJoiner joiner_;
  ImuStream imu_;
  ImuJoiner imu_joiner_;
  PoseStream poses_;
  ReaderReport report_;
  std::size_t pair_count_ = 0;
  std::optional<Stamp> start_;  // stamp of the first frame of the recording, by the present clock
  Stamp last_ = 0;              // stamp of the last frame
  Stamp newest_log_time_ = 0;
  bool ended_ = false;                 // the bag has ended
  bool is_over_ = false;               // the window has ended
  std::optional<SensorPacket> first_;  // first packet, read by the constructor
};

}  // namespace km
