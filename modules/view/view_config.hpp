#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Parameters of what a robot tells those who watch.
struct ViewConfig {
  static constexpr const char* kSection = "view";

  bool on = false;
  bool in_clear = false;
  double bytes_per_s = 2000.0;
  double past_bytes_per_s = 20000.0;
  double mesh_bytes_per_s = 80000.0;
  double images_per_s = 2.0;

  void visit_fields(auto& visitor) {
    visitor.field("on", on,
                  "send this robot's trajectory, mesh and images to anybody in the domain who asks "
                  "(kimera_multi_viewer), as with --view; costs nothing while nobody asks");
    visitor.field("in_clear", in_clear,
                  "where the team has keys: tell it nevertheless; anybody on the network can read "
                  "it then");
    visitor.field("bytes_per_s", bytes_per_s, {500.0, 1e9},
                  "[B/s] at most, of all but what follows; what is beyond it is told later");
    visitor.field("past_bytes_per_s", past_bytes_per_s, {500.0, 1e9},
                  "[B/s] at most, while the past is told to one who has come");
    visitor.field("mesh_bytes_per_s", mesh_bytes_per_s, {1000.0, 1e9},
                  "[B/s] at most, of the mesh; its pieces are those of mesh_chunks");
    visitor.field("images_per_s", images_per_s, {0.0, 30.0},
                  "[1/s] camera images, 640 pixels wide, while somebody asks for them; 0: none");
  }
};

}  // namespace km
