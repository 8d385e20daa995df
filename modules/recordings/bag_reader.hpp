#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "modules/core/data/fault_report.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// Messages of one kind from one source, as the recording describes them.
struct BagChannel {
  std::string topic;                ///< "/camera/left/image_raw".
  std::string type;                 ///< "sensor_msgs/Image", "sensor_msgs/msg/Image".
  std::string encoding;             ///< "ros1", "cdr", or another name in the recording.
  std::uint64_t message_count = 0;  ///< Number of messages, from the index or counted.
};

struct BagMessage {
  std::size_t channel = 0;  ///< Index into BagReader::channels().
  Stamp log_time = 0;       ///< Time at which the message was recorded [ns].
  std::vector<std::uint8_t> bytes;
};

/// Faults in a part of a recording that leave the rest usable. The reader skips that part. After
/// kChecksum outside of chunks it skips nothing, because the position of the wrong bytes is
/// unknown.
enum class BagFault {
  kTruncated,       ///< The file ends within a record, or without an end.
  kIndex,           ///< The index does not fit the file: the file is read from its beginning.
  kMalformed,       ///< An invalid record.
  kChecksum,        ///< The bytes differ from those that were written.
  kCompression,     ///< An unknown compression, or corrupted compressed data.
  kUnknownChannel,  ///< A message whose channel is not described before it.
  kUnordered,  ///< A message earlier than its chunk states, after later messages were returned.
  kLost,       ///< A live message dropped because the reader was slow, or lost in part.
};

/// A short plural for tables and log lines: "malformed records".
[[nodiscard]] const char* to_string(BagFault fault);

/// Counts of the faults, with file, byte position and, if known, topic of examples.
using BagReport = FaultReport<BagFault>;

/// A recording as one stream of messages in order of log time; messages of equal time are in the
/// order of the file. The content is untrusted, and only the parts being read are in memory. Not
/// thread-safe.
class BagReader {
 public:
  virtual ~BagReader() = default;

  /// All channels by the index or, without an index, by the recording. A channel that is found
  /// later is appended.
  [[nodiscard]] virtual const std::vector<BagChannel>& channels() const = 0;

  /// The next message, or nullopt at the end. Throws InputFileError if the file cannot be read any
  /// more.
  [[nodiscard]] virtual std::optional<BagMessage> next() = 0;

  /// Faults met so far.
  [[nodiscard]] virtual BagReport report() const = 0;

  /// True for live topics, which have no end: log times are times of arrival.
  [[nodiscard]] virtual bool is_live() const { return false; }

  /// Ends the present and every later wait in next(). Thread-safe.
  virtual void stop() noexcept {}
};

/// Channels with unique topic, type and encoding. Messages of a restarted publisher, or of another
/// file of the recording, belong to the same channel.
class ChannelTable {
 public:
  /// Adds a channel, or the message count of a known one, and returns its index.
  std::size_t add(const BagChannel& channel) {
    const auto [known, is_new] = index_.try_emplace(
        std::tuple(channel.topic, channel.type, channel.encoding), channels_.size());
    if (is_new)
      channels_.push_back(channel);
    else
      channels_[known->second].message_count += channel.message_count;
    return known->second;
  }

  [[nodiscard]] BagChannel& at(std::size_t index) { return channels_.at(index); }
  [[nodiscard]] const std::vector<BagChannel>& channels() const { return channels_; }

 private:
  std::vector<BagChannel> channels_;
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> index_;
};

}  // namespace km
