#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/fault_report.hpp"
#include "modules/core/frame.hpp"
#include "modules/sensors/load_shedding.hpp"

namespace km {

/// Faults in a part of a recording that leave the rest usable. In general the row, sample or frame
/// is skipped. An unusable depth or label image only leaves its frame without one. After kImuGap,
/// kUnknownColor, kMissingBetween and kPause nothing is skipped.
enum class ReaderFault {
  kMalformedRow,       ///< Too few fields, or a stamp or value that is not a number.
  kNotFinite,          ///< NaN or infinity in an inertial sample.
  kImplausible,        ///< An inertial sample beyond the range of sensors.
  kUnorderedStamp,     ///< Earlier than previous rows, or later than following rows.
  kRepeatedStamp,      ///< Equal to a row before.
  kJumpingStamp,       ///< More than an hour away from most rows.
  kLeftWithoutRight,   ///< No right image within the tolerance.
  kRightWithoutLeft,   ///< No left image within the tolerance.
  kMissingImage,       ///< Listed, but not on disk.
  kUnreadableImage,    ///< Truncated, corrupt or of an unknown format.
  kWrongImageSize,     ///< Not the resolution of the calibration.
  kImuGap,             ///< Inertial samples further apart than 2.5 periods.
  kPairWithoutImu,     ///< Outside the time that inertial samples cover.
  kWrongImageFormat,   ///< Not the bits or channels of its kind: depth, labels.
  kImageWithoutFrame,  ///< A depth or label image that belongs to no frame.
  kUnknownColor,       ///< A label image with colours that are not in the palette.
  kMalformedMessage,   ///< A message of a bag that is not of its type.
  kNoAcceleration,     ///< A gyroscope sample without accelerometer samples around it.
  kDamagedBag,         ///< A part of a bag that cannot be read (see BagFault).
  kFrameWithoutPose,   ///< An external odometry has no pose for the frame.
  kLostMessage,        ///< A live message dropped because the reader was too slow.
  kMissingBetween,     ///< An image that is missing, judged by the stamps around it.
  kPause,              ///< No image for more than MissingImages::kPause_s.
};

/// A short plural for tables and log lines: "malformed rows".
[[nodiscard]] const char* to_string(ReaderFault fault);

/// Examples of faults name file and line.
using ReaderReport = FaultReport<ReaderFault>;

/// A recording that cannot be used at all. what() is one line with the file, the value and, if
/// there is one, the line.
struct DatasetError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A source of sensor packets in order of time. Not thread-safe.
class DatasetReader {
 public:
  virtual ~DatasetReader() = default;

  [[nodiscard]] virtual const SensorRig& rig() const = 0;

  /// Decides about a frame before its images are decoded. `arrival`: time at which a live frame was
  /// complete [ns since 1970], 0 for a recording. The stamps of a live frame cannot replace the
  /// arrival, because they may be of any clock, also of a simulator's slower one.
  using ChooseUse = std::function<FrameUse(Stamp stamp, Stamp arrival)>;

  /// The next packet of a frame that `choose` uses, or nullopt at the end. Faults are skipped and
  /// counted. The samples of a frame that is skipped or not used are part of the next packet, so
  /// that the intervals have no holes.
  [[nodiscard]] virtual std::optional<SensorPacket> next(const ChooseUse& choose) = 0;

  /// The next packet; every frame is used.
  [[nodiscard]] std::optional<SensorPacket> next() {
    return next([](Stamp, Stamp) { return FrameUse::kAll; });
  }

  /// Faults met so far.
  [[nodiscard]] virtual ReaderReport report() const = 0;

  /// Remarks on how the source is read, for the user, a line each; complete with the first packet.
  [[nodiscard]] virtual std::vector<std::string> remarks() const { return {}; }

  /// True if packets have the poses of an external odometry. Then there may be no inertial samples.
  [[nodiscard]] virtual bool gives_poses() const { return false; }

  /// True if sensors measure now: next() waits for them, and there is no end.
  [[nodiscard]] virtual bool is_live() const { return false; }

  /// Makes next() return nullopt, now and later, also while it waits. Thread-safe.
  virtual void stop() noexcept {}

  /// Largest number of frames that next() can return; 0 if it is not known.
  [[nodiscard]] virtual std::size_t pair_count() const = 0;
};

}  // namespace km
