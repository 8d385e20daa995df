#pragma once

#include "runtime/dds/codec.hpp"
#include "runtime/dds/robot_status.hpp"
#include "status.h"

namespace km {

template <>
struct Codec<RobotStatus> {
  using Wire = km_wire_RobotStatus;
  static constexpr const char* kTopic = "robot_status";
  static constexpr std::uint16_t kVersion = 1;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_RobotStatus_desc; }

  struct Encoded {
    Wire wire{};
  };
  static Encoded encode(const RobotStatus& status);
  static Decoded<RobotStatus> decode(const Wire& wire);
};

}  // namespace km
