#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/stamp.hpp"
#include "modules/recordings/mcap_writer.hpp"

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

  /// Writes all buffered messages. Called once a second.
  virtual void flush() {}

  /// Attaches a text file, if the sink stores files.
  virtual void attach(const std::string& /*name*/, std::string_view /*text*/) {}

  /// Ends the output.
  virtual void finish() {}
};

/// Writes messages into one MCAP file, with the definitions of their types. If the process is
/// killed, the file is complete up to the last flush(). If writing fails, for example because the
/// disk is full, the file ends with its last complete chunk and later messages are dropped.
/// Messages without a time are dropped too, because a viewer would show them half a century before
/// the others.
class McapSink final : public RosSink {
 public:
  /// The first message replaces `file`. `fail` is called once, with the reason, if the file cannot
  /// be written; later messages are dropped.
  McapSink(std::filesystem::path file, std::function<void(const std::string& why)> fail);

  std::size_t open(const PublishedTopic& topic) override;
  void put(std::size_t topic, std::optional<Stamp> time,
           std::span<const std::uint8_t> message) override;
  void flush() override;
  void attach(const std::string& name, std::string_view text) override;
  void finish() override;

 private:
  void write();

  const std::filesystem::path file_;
  const std::function<void(const std::string&)> fail_;
  McapWriter writer_{{}};
  std::vector<std::uint32_t> sequences_;  // sequence number of each topic; the channel of topic k
                                          // is k + 1
  Stamp newest_ = 0;                      // newest stamp of the messages
  std::uint64_t written_ = 0;             // [bytes]
  bool failed_ = false;
};

}  // namespace km
