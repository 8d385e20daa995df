#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "modules/recordings/mcap_writer.hpp"
#include "modules/ros_dds/ros_sink.hpp"

namespace km {

/// Messages into one MCAP file, with the definitions of their types. Of a process that is killed
/// the file is whole up to the last flush(). Where it cannot be written, the disk being full, it
/// ends with its last whole part, and whatever follows is left out. A message without a time is,
/// too: on a time line it would lie half a century before the others.
class McapSink final : public RosSink {
 public:
  /// With the first message `file` is replaced. `fail` is told, once, why the file ends too early.
  McapSink(std::filesystem::path file, std::function<void(const std::string& why)> fail);

  std::size_t open(const ToldTopic& topic) override;
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
  std::vector<std::uint32_t> sequences_;  // by topic, whose number is its channel's less one
  Stamp newest_ = 0;                      // of the messages
  std::uint64_t written_ = 0;             // [bytes]
  bool failed_ = false;
};

}  // namespace km
