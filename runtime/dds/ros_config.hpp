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
  int mesh_points = 200000;
  int mesh_faces = 50000;

  void visit_fields(auto& visitor) {
    visitor.field("domain", domain, {0, 230}, "ROS_DOMAIN_ID of drivers and viewers");
    visitor.field("interface", interface,
                  "network interface of theirs; empty: chosen; lo with ROS_LOCALHOST_ONLY=1");
    visitor.field("peers", peers, "addresses of their hosts, for networks without multicast");
    visitor.field("publish", publish,
                  "publish the robot's state for viewers: odometry, pose, tf, path, mesh, "
                  "diagnostics; none: with --live");
    visitor.field("mesh_points", mesh_points, {0, 10000000},
                  "maximum number of mesh vertices published for viewers, 12 to 16 B each, "
                  "whenever the mesh is corrected; 0: none");
    visitor.field("mesh_faces", mesh_faces, {0, 1000000},
                  "maximum number of mesh faces published for viewers, 120 B each, also kept for "
                  "late ones; larger meshes are coarsened; 0: none");
  }
};

}  // namespace km
