#pragma once

#include <map>
#include <optional>
#include <string>

#include "modules/core/geometry.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// Frames that stand still to each other, as /tf_static tells them. Names are the same with a slash
/// before them, which ROS 1 had, and without.
class StaticTransforms {
 public:
  /// Of a frame that is told again the last counts. What is no rigid transform is left out.
  void add(const RosTransforms& message);

  /// T_a_b through any number of frames, in either direction; nullopt if no chain joins them.
  [[nodiscard]] std::optional<SE3> find(const std::string& a, const std::string& b) const;

  /// "base_link, cam0, imu", or "none".
  [[nodiscard]] std::string frames() const;

 private:
  std::map<std::string, std::map<std::string, SE3>> T_a_b_;  // by a, by b; both directions
};

}  // namespace km
