#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/fault_report.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Messages of one kind from one source, as the recording describes them.
struct BagChannel {
  std::string topic;                ///< "/camera/left/image_raw".
  std::string type;                 ///< "sensor_msgs/Image", "sensor_msgs/msg/Image".
  std::string encoding;             ///< "ros1", "cdr", or what else the recording says.
  std::uint64_t message_count = 0;  ///< As the index says, or as found where there is none.
};

struct BagMessage {
  std::size_t channel = 0;  ///< Index into BagReader::channels().
  Stamp log_time = 0;       ///< When it was recorded [ns].
  std::vector<std::uint8_t> bytes;
};

/// What can be wrong with a piece of a recording without making the rest useless. What is concerned
/// is skipped, but after kChecksum outside of chunks, where which bytes are wrong is not known.
enum class BagFault {
  kTruncated,       ///< The file ends within a record, or without an end.
  kIndex,           ///< An index that does not fit the file: the file is read from its beginning.
  kMalformed,       ///< A record that cannot be right.
  kChecksum,        ///< Bytes that are not those that were written.
  kCompression,     ///< Of an unknown kind, or that cannot be undone.
  kUnknownChannel,  ///< A message whose channel is described nowhere before it.
  kUnordered,       ///< A message earlier than its chunk says: later ones were given already.
  kLost,            ///< A live message that came faster than it was taken, or only in part.
};

/// A short plural for tables and log lines: "malformed records".
[[nodiscard]] const char* to_string(BagFault fault);

/// Its examples name the file, the byte in it, and the topic where it is known.
using BagReport = FaultReport<BagFault>;

/// A recording of messages as one stream in order of log time, messages of equal time in that of
/// the file. Nothing in it is trusted, and only the parts being read are in memory. Not
/// thread-safe.
class BagReader {
 public:
  virtual ~BagReader() = default;

  /// All that the recording's index or, where it has none, the recording describes. A channel that
  /// is found later is appended.
  [[nodiscard]] virtual const std::vector<BagChannel>& channels() const = 0;

  /// The next message, or nullopt at the end. Throws InputFileError if the file cannot be read any
  /// more.
  [[nodiscard]] virtual std::optional<BagMessage> next() = 0;

  /// Faults met so far.
  [[nodiscard]] virtual BagReport report() const = 0;

  /// True for what happens now and has no end: log times are those of arrival.
  [[nodiscard]] virtual bool is_live() const { return false; }

  /// Ends next(), now and later, where it waits. Thread-safe.
  virtual void stop() noexcept {}
};

}  // namespace km
