#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "modules/core/stamp.hpp"

namespace km {

/// A topic that is to be told.
struct ToldTopic {
  std::string name;
  std::string_view type;  ///< kType of its messages.
  bool is_state = false;  ///< The newest message is all there is to know: late comers get it.
  int depth = 10;         ///< Messages kept for those who take them slowly.
};

/// Where messages of ROS go: to those who listen, or into a file. Not thread-safe.
class RosSink {
 public:
  virtual ~RosSink() = default;

  /// The topic's number.
  virtual std::size_t open(const ToldTopic& topic) = 0;

  /// A message as encode_ros() makes it. `time`: of the robot's sensors; nullopt while there is
  /// none yet.
  virtual void put(std::size_t topic, std::optional<Stamp> time,
                   std::span<const std::uint8_t> message) = 0;

  /// What was put is not held back any longer. Called once a second.
  virtual void flush() {}

  /// A file that belongs to what was put, if it is kept.
  virtual void attach(const std::string& /*name*/, std::string_view /*text*/) {}

  /// Nothing follows.
  virtual void finish() {}
};

}  // namespace km
