#pragma once

#include <map>
#include <optional>
#include <string>

#include "modules/core/geometry.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// Frames with constant relative poses, from /tf_static. A name with a leading slash, as in ROS 1,
/// equals the name without it.
class StaticTransforms {
 public:
  /// A later transform of a frame replaces the former one. A transform that is not rigid is
  /// skipped.
  void add(const RosTFMessage& message);

  /// T_a_b through any number of frames, in either direction; nullopt if no chain joins them.
  [[nodiscard]] std::optional<SE3> find(const std::string& a, const std::string& b) const;

  /// "base_link, cam0, imu", or "none".
  [[nodiscard]] std::string frames() const;

 private:
  std::map<std::string, std::map<std::string, SE3>> T_a_b_;  // [a][b] and [b][a]
};

}  // namespace km
