#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of the updates for viewers.
struct ViewConfig {
  static constexpr const char* kSection = "view";

  bool on = false;
  double bytes_per_s = 2000.0;
  double images_per_s = 2.0;

  /// Maximum rate while earlier data are sent to a new viewer.
  [[nodiscard]] double past_bytes_per_s() const { return 10.0 * bytes_per_s; }
  /// Maximum rate of the map: the mesh in chunks, and objects and 2D map, at most a quarter of it.
  [[nodiscard]] double mesh_bytes_per_s() const { return 40.0 * bytes_per_s; }

  void visit_fields(auto& visitor) {
    visitor.field(
        "on", on,
        "send trajectory, mesh and images of this robot to any viewer in the domain that asks for "
        "them (kimera_multi_viewer), as with --view; costs nothing without viewers");
    visitor.field(
        "bytes_per_s", bytes_per_s, {20.0, 1e8},
        "[B/s] maximum rate of state, poses and closures; updates beyond it are sent later; ten "
        "times as much while earlier data are sent to a new viewer, and 40 times for the map");
    visitor.field("images_per_s", images_per_s, {0.0, 30.0},
                  "[1/s] camera images, 640 pixels wide, while a viewer asks for them; 0: none");
  }
};

}  // namespace km
