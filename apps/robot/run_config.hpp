#pragma once

#include <string>

#include "modules/core/config.hpp"

namespace km {

/// What a robot needs beside its modules.
struct RunConfig {
  static constexpr const char* kSection = "run";

  std::string vocabulary = "vocabulary/indoor.kmvoc";
  std::string link = "wired";
  double settle_s = 3.0;
  double patience = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field("vocabulary", vocabulary,
                  "of place recognition: a file, or one that comes with the program");
    visitor.field("link", link, "profile, see config/qos: wired, wifi, intermittent, or a file");
    visitor.field(
        "settle_s", settle_s, {0.1, 600.0},
        "[s] the robot leaves when it and all present peers have had nothing to do for so long");
    visitor.field("patience", patience, {0.1, 100.0},
                  "on slow computers more: times 30 s (pose graph and map: 120 s, mesh files: 300 "
                  "s) that a module may take "
                  "for one step before it is taken for hung and the robot ends without it");
  }
};

}  // namespace km
