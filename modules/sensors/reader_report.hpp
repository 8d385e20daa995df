#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace km {

/// What can be wrong with a piece of a recording without making the rest useless. Each is a skip of
/// the row, sample or frame concerned, with two exceptions: a depth or label image that cannot be
/// used leaves its frame without one, and after kImuGap and kUnknownColor reading goes on.
enum class ReaderFault {
  kMalformedRow,       ///< Too few fields, or a stamp or value that is not a number.
  kNotFinite,          ///< NaN or infinity in an inertial sample.
  kUnorderedStamp,     ///< Earlier than the row before.
  kRepeatedStamp,      ///< Equal to the row before.
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
};

/// A short plural for tables and log lines: "malformed rows".
[[nodiscard]] const char* to_string(ReaderFault fault);

/// Counts of what a reader met, with the first example of each kind, which names file and line.
class ReaderReport {
 public:
  struct Entry {
    std::size_t count = 0;
    std::string first;
  };

  void add(ReaderFault fault, const std::string& example);
  [[nodiscard]] std::size_t count(ReaderFault fault) const;
  [[nodiscard]] const std::map<ReaderFault, Entry>& entries() const { return entries_; }
  [[nodiscard]] bool empty() const { return entries_.empty(); }

 private:
  std::map<ReaderFault, Entry> entries_;
};

/// One line per kind of fault: "3 missing images, first: cam0/data.csv line 7: ...". Empty if there
/// is none.
[[nodiscard]] std::string to_string(const ReaderReport& report);

}  // namespace km
