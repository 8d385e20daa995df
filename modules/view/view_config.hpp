#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the updates for viewers.
struct ViewConfig {
  static constexpr const char* kSection = "view";

  bool on = false;
  bool in_clear = false;
  double bytes_per_s = 2000.0;
  double past_bytes_per_s = 20000.0;
  double mesh_bytes_per_s = 80000.0;
  double images_per_s = 2.0;

  void visit_fields(auto& visitor) {
    visitor.field(
        "on", on,
        "send trajectory, mesh and images of this robot to any viewer in the domain that asks for "
        "them (kimera_multi_viewer), as with --view; costs nothing without viewers");
    visitor.field("in_clear", in_clear,
                  "in a team with keys: send unencrypted updates nevertheless, which any computer "
                  "on the network can read");
    visitor.field(
        "bytes_per_s", bytes_per_s, {500.0, 1e9},
        "[B/s] maximum rate of state, poses and closures; updates beyond it are sent later");
    visitor.field("past_bytes_per_s", past_bytes_per_s, {500.0, 1e9},
                  "[B/s] maximum rate while earlier data are sent to a new viewer");
    visitor.field("mesh_bytes_per_s", mesh_bytes_per_s, {1000.0, 1e9},
                  "[B/s] maximum rate of the map: the mesh in chunks, and objects, 2D "
                  "map and slice of the distance field, at most a quarter of it");
    visitor.field("images_per_s", images_per_s, {0.0, 30.0},
                  "[1/s] camera images, 640 pixels wide, while a viewer asks for them; 0: none");
  }
};

}  // namespace km
