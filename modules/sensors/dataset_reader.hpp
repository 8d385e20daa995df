#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/data/fault_report.hpp"
#include "modules/sensors/load_shedding.hpp"

namespace km {

/// Faults in a part of a recording that leave the rest usable. In general the row, sample or frame
/// is skipped. If a depth or label image is unusable, only this image is omitted. After kImuGap,
/// kUnknownColor, kMissingBetween, kPause and kClockSetBack nothing is skipped. The kinds from
/// kNotFinite to kNoAcceleration are of inertial samples.
enum class ReaderFault {
  kMalformedRow,       ///< Too few fields, or a stamp or value that is not a number.
  kNotFinite,          ///< NaN or infinity in an inertial sample.
  kImplausible,        ///< An inertial sample beyond the range of sensors.
  kMalformedSample,    ///< A row or message of an inertial sensor that is no sample.
  kUnorderedSample,    ///< As kUnorderedStamp, of an inertial sample.
  kRepeatedSample,     ///< As kRepeatedStamp, of an inertial sample.
  kJumpingSample,      ///< As kJumpingStamp, of an inertial sample.
  kImuGap,             ///< Inertial samples further apart than 2.5 periods.
  kNoAcceleration,     ///< A gyroscope sample without accelerometer samples around it.
  kUnorderedStamp,     ///< A stamp before that of previous rows, or after that of following rows.
  kRepeatedStamp,      ///< A stamp equal to that of a previous row.
  kJumpingStamp,       ///< A stamp more than an hour away from most rows.
  kLeftWithoutRight,   ///< A left image without a right image within the tolerance.
  kRightWithoutLeft,   ///< A right image without a left image within the tolerance.
  kImageWithoutTime,   ///< An image after the last row of the list of times.
  kMissingImage,       ///< An image that is listed, but not on disk.
  kUnreadableImage,    ///< A truncated or corrupt image, or one of an unknown format.
  kWrongImageSize,     ///< An image without the resolution of the calibration.
  kPairWithoutImu,     ///< A frame outside the time that inertial samples cover.
  kWrongImageFormat,   ///< A depth or label image with wrong bits or channels.
  kImageWithoutFrame,  ///< A depth or label image that belongs to no frame.
  kUnknownColor,       ///< A label image with colours that are not in the palette.
  kMalformedMessage,   ///< A message of a bag that is not of its type.
  kDamagedBag,         ///< A part of a bag that cannot be read (see BagFault).
  kFrameWithoutPose,   ///< An external odometry has no pose for the frame.
  kLostMessage,        ///< A live message dropped because the reader was too slow.
  kMissingBetween,     ///< An image that is missing, judged by the stamps around it.
  kPause,              ///< No image for more than MissingImages::kPause_s.
  kClockSetBack,       ///< The clock was set back: later stamps are moved, see ContinuousTime.
};

/// A short plural for tables and log lines: "malformed rows".
[[nodiscard]] const char* to_string(ReaderFault fault);

/// The kind of a fault in the list or topic of an inertial sensor, whose items are counted apart.
[[nodiscard]] ReaderFault fault_of_samples(ReaderFault fault);

/// Counts of the faults, with file and line of examples.
using ReaderReport = FaultReport<ReaderFault>;

/// A recording that cannot be used at all. what() is one line of text with the file, the value and,
/// for text files, the line number.
struct DatasetError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Part of a recording, in seconds since its first frame.
struct RecordingPart {
  double from_s = 0.0;                                    ///< First instant of the part.
  double to_s = std::numeric_limits<double>::infinity();  ///< First instant after the part.
  std::optional<Stamp> not_before = {};                   ///< No frame before this instant.

  /// Throws std::invalid_argument for a part that is empty or not a number. `recording`: path for
  /// the message.
  void check(const std::string& recording) const;
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

  /// Remarks for the user on the way the source is read, one line each; complete with the first
  /// packet.
  [[nodiscard]] virtual std::vector<std::string> remarks() const { return {}; }

  /// True if packets have the poses of an external odometry. Then there may be no inertial samples.
  [[nodiscard]] virtual bool gives_poses() const { return false; }

  /// True for live sensors: next() waits for measurements, and there is no end.
  [[nodiscard]] virtual bool is_live() const { return false; }

  /// Makes next() return nullopt, now and later, also while it waits. Thread-safe.
  virtual void stop() noexcept {}

  /// Largest number of frames that next() can return; 0 if it is not known.
  [[nodiscard]] virtual std::size_t pair_count() const = 0;
};

}  // namespace km
