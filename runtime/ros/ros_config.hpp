#pragma once

#include <optional>
#include <string>
#include <vector>

#include "modules/core/config.hpp"

namespace km {

/// Connection to ROS 2.
struct RosConfig {
  static constexpr const char* kSection = "ros";

  int domain = 0;
  std::string interface;
  std::vector<std::string> peers = {};
  std::optional<bool> publish = {};

  void visit_fields(auto& visitor) {
    visitor.field("domain", domain, {0, 230}, "ROS_DOMAIN_ID of drivers and viewers");
    visitor.field(
        "interface", interface,
        "network interface to them; empty: chosen automatically; lo with ROS_LOCALHOST_ONLY=1");
    visitor.field("peers", peers, "addresses of their hosts, for networks without multicast");
    visitor.field("publish", publish,
                  "publish the robot's state for viewers: odometry, pose, tf, path, mesh, "
                  "diagnostics; none: with --live");
  }
};

}  // namespace km
