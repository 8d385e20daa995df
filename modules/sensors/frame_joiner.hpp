#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "modules/recordings/bag_reader.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/synchrony.hpp"

namespace km {

enum class ImageRole { kLeft, kRight, kDepth };

/// The messages with the images of one instant.
struct JoinedFrame {
  Stamp stamp = 0;  ///< Of the left image.
  BagMessage left;
  std::optional<BagMessage> right, depth;
};

/// Joins streams of images into frames by their stamps, as they come. A frame has a left image,
/// with a right camera also a right one, and depth where there is some for it.
///
/// The first images, kSample of each stream, are held back until it is known how their stamps go
/// together. From there on a frame waits for images of other streams until one with a later stamp
/// has come or until the log is kPatience_s on; images without a partner are counted.
class FrameJoiner {
 public:
  static constexpr std::size_t kSample = 20;
  static constexpr double kPatience_s = 1.0;
  static constexpr std::size_t kMaxHeld = 200;  ///< Of a stream; the oldest goes.

  /// `tolerance_s`: of the stamps, with no offset; nullopt: it follows from the stamps.
  FrameJoiner(bool has_right, bool has_depth, std::optional<double> tolerance_s);

  /// Stamps of a stream ascend.
  void add(ImageRole role, Stamp stamp, BagMessage message);

  /// The next frame that is complete.
  [[nodiscard]] std::optional<JoinedFrame> next();

  /// No further image will come.
  void finish() { finished_ = true; }

  /// Images that belong to no frame.
  [[nodiscard]] const ReaderReport& report() const { return report_; }

  /// Of the right images, or of depth; nullopt while it is not known, or without such a stream.
  [[nodiscard]] std::optional<Synchrony> right_synchrony() const { return right_.synchrony; }
  [[nodiscard]] std::optional<Synchrony> depth_synchrony() const { return depth_.synchrony; }

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

  void drop_oldest(ImageRole role);
  [[nodiscard]] Stream& stream_of(ImageRole role);
  [[nodiscard]] bool knows_synchrony();
  [[nodiscard]] bool has_waited() const;
  [[nodiscard]] Partner find_partner(ImageRole role);

  Stream left_, right_, depth_;
  ReaderReport report_;
  Stamp newest_log_time_ = 0;
  bool finished_ = false;
};

}  // namespace km
