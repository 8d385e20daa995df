#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "modules/recordings/mcap_writer.hpp"
#include "modules/ros_dds/ros_sink.hpp"

namespace km {

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
