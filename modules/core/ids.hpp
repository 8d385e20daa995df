#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace km {

/// Any 16-bit number, unique in the team; ids may have gaps and need not be known in advance.
using RobotId = std::uint16_t;

/// Index of a keyframe of its robot, counted from 0 without gaps.
using KeyframeIndex = std::uint32_t;

/// A keyframe: its robot and its index.
struct KeyframeId {
  RobotId robot = 0;
  KeyframeIndex index = 0;

  auto operator<=>(const KeyframeId&) const = default;
};

/// "robot:index", for messages and files.
inline std::string to_string(const KeyframeId& id) {
  return std::to_string(id.robot) + ':' + std::to_string(id.index);
}

}  // namespace km

template <>
struct std::hash<km::KeyframeId> {
  std::size_t operator()(const km::KeyframeId& id) const noexcept {
    return std::hash<std::uint64_t>{}((std::uint64_t{id.robot} << 32U) | id.index);
  }
};
