#pragma once

#include <cstddef>
#include <optional>
#include <stdexcept>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/sensors/reader_report.hpp"

namespace km {

/// A recording that cannot be used at all. what() is one line that names the file, the line where
/// there is one, and the value.
struct DatasetError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A source of sensor packets in order of time. Not thread-safe.
class DatasetReader {
 public:
  virtual ~DatasetReader() = default;

  [[nodiscard]] virtual const SensorRig& rig() const = 0;

  /// The next packet, or nullopt at the end. Faults on the way are skipped and counted. The samples
  /// of a skipped pair are part of the packet after it, so that the intervals stay without a hole.
  [[nodiscard]] virtual std::optional<SensorPacket> next() = 0;

  /// Faults met so far.
  [[nodiscard]] virtual const ReaderReport& report() const = 0;

  /// Frames that next() can give at most.
  [[nodiscard]] virtual std::size_t pair_count() const = 0;
};

}  // namespace km
