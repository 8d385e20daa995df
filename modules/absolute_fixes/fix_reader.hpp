#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "modules/absolute_fixes/absolute_fixes_config.hpp"
#include "modules/absolute_fixes/geodetic.hpp"
#include "modules/core/data/received_fix.hpp"
#include "modules/core/stamp.hpp"
#include "modules/recordings/bag_reader.hpp"

namespace km {

/// A fix in the absolute frame.
struct TimedPosition {
  Stamp stamp = 0;
  Eigen::Vector3d p_datum = Eigen::Vector3d::Zero();  ///< [m]
  double sigma_m = 1.0;                               ///< On each axis.
};

/// Fixes by the reason for which they are not used.
struct FixCounts {
  std::uint64_t received = 0;
  std::uint64_t without_position = 0;  ///< The receiver reports that it has no position.
  std::uint64_t not_finite = 0;
  std::uint64_t too_uncertain = 0;   ///< See max_sigma_m.
  std::uint64_t far_from_datum = 0;  ///< Beyond kFix_m.
  std::uint64_t out_of_order = 0;    ///< The stamp is not after that of the fix before.
  std::uint64_t malformed = 0;       ///< Messages of another type, and faulty rows.
  std::uint64_t far_from_keyframe =
      0;  ///< Another fix is nearer to the keyframe, or no pose is known at the time.
};

/// Reads fixes from messages and files. Fixes that state no standard deviation have that of the
/// configuration; others the root of the mean variance of the axes. Not thread-safe.
class FixReader {
 public:
  /// Throws ConfigError with a remedy if the configuration names no source or several, or a list of
  /// another length.
  explicit FixReader(const AbsoluteFixesConfig& config);

  /// The fix of a message; nullopt for a message that is counted as unusable.
  [[nodiscard]] std::optional<ReceivedFix> decode(const BagChannel& channel,
                                                  const BagMessage& message);
  /// The fix in the absolute frame; nullopt if it is counted as unusable. The first one is the
  /// datum unless the configuration has one.
  [[nodiscard]] std::optional<TimedPosition> accept(const ReceivedFix& fix);
  /// All usable rows of a file. Throws InputFileError if it has none.
  [[nodiscard]] std::vector<TimedPosition> read(const std::filesystem::path& file);
  /// All usable messages of the topic. Throws InputFileError if the recording does not have it.
  [[nodiscard]] std::vector<TimedPosition> read(BagReader& bag);

  [[nodiscard]] const AbsoluteFixesConfig& config() const { return config_; }
  [[nodiscard]] const FixCounts& counts() const { return counts_; }
  /// Origin of the frame; absent before the first fix, and for a motion capture.
  [[nodiscard]] const std::optional<GeodeticPoint>& datum() const { return datum_; }
  /// Identity of the frame, see PositionFix. 0 before the first fix.
  [[nodiscard]] std::uint64_t datum_id() const;

 private:
  template <typename Message>
  std::optional<ReceivedFix> decode_as(const BagChannel& channel, const BagMessage& message);

  AbsoluteFixesConfig config_;
  FixCounts counts_;
  std::optional<GeodeticPoint> datum_;
  std::optional<EnuFrame> enu_;
  std::optional<Stamp> last_;
};

/// Rows of a file of fixes.
struct FixRows {
  std::vector<ReceivedFix> fixes;
  std::uint64_t malformed = 0;  ///< Number of other rows.
};

/// Reads a stamp ([ns] in a .csv file, else [s]) and three coordinates of each row. Throws
/// InputFileError if the file cannot be read.
[[nodiscard]] FixRows read_fix_rows(const std::filesystem::path& file);

/// True if a robot can read fixes of `source` from messages of this channel.
[[nodiscard]] bool has_fixes(const BagChannel& channel, FixSource source);

}  // namespace km
