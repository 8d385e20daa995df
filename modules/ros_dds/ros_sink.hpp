#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "modules/core/stamp.hpp"

namespace km {

/// A topic of a RosSink.
struct PublishedTopic {
  std::string name;
  std::string_view type;  ///< kType of its messages.
  bool is_state = false;  ///< The newest message is the full state: late subscribers receive it.
  int depth = 10;         ///< Number of messages kept for slow readers.
};

/// Receiver of ROS messages: topics or a file. Not thread-safe.
class RosSink {
 public:
  virtual ~RosSink() = default;

  /// Returns the number of the topic.
  virtual std::size_t open(const PublishedTopic& topic) = 0;

  /// Writes a message encoded by encode_ros(). `time` is the time of the robot's sensors; nullopt
  /// before the first stamp.
  virtual void put(std::size_t topic, std::optional<Stamp> time,
                   std::span<const std::uint8_t> message) = 0;

  /// Number of readers of a topic; 0 for a file.
  [[nodiscard]] virtual std::size_t readers(std::size_t /*topic*/) const { return 0; }

  /// Writes all buffered messages. Called once a second.
  virtual void flush() {}

  /// Attaches a text file, if the sink stores files.
  virtual void attach(const std::string& /*name*/, std::string_view /*text*/) {}

  /// Ends the output.
  virtual void finish() {}
};

}  // namespace km
