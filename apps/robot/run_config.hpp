#pragma once

#include <string>

#include "modules/core/config.hpp"

namespace km {

/// Parameters of a robot that belong to no module.
struct RunConfig {
  static constexpr const char* kSection = "run";

  std::string vocabulary = "vocabulary/indoor.kmvoc";
  std::string link = "wired";
  double settle_s = 3.0;
  double patience = 1.0;

  void visit_fields(auto& visitor) {
    visitor.field("vocabulary", vocabulary,
                  "vocabulary of place recognition: a file, or one that comes with the program");
    visitor.field("link", link,
                  "link profile, see config/qos: wired, wifi, intermittent, or a file");
    visitor.field(
        "settle_s", settle_s, {0.1, 600.0},
        "[s] the robot leaves when it and all present peers have been idle for this time");
    visitor.field(
        "patience", patience, {0.1, 100.0},
        "increase on slow computers: factor on the time limit for one step of a module "
        "(30 s; pose graph, map, journal, network and viewers: 120 s; files of meshes and "
        "of the record: 300 s); a module that exceeds its limit counts as hung, and the "
        "robot ends without it");
  }
};

}  // namespace km
