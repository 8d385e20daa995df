#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <optional>

#include "modules/recordings/bag_reader.hpp"
#include "modules/sensors/dataset_reader.hpp"
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

}  // namespace km
