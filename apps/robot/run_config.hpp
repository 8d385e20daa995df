#pragma once

#include <string>

#include "modules/core/config.hpp"

namespace km {

/// What a robot needs beside its modules. Field names are the YAML keys below `run:`.
struct RunConfig {
  static constexpr const char* kSection = "run";

  /// Vocabulary of place recognition: a file, or one that comes with the program.
  std::string vocabulary = "vocabulary/indoor.kmvoc";

  /// Link profile (see config/qos): a name, or a file.
  std::string link = "wired";

  /// The robot leaves when it and all present peers have had nothing to do for this long [s].
  double settle_s = 3.0;

  void visit_fields(auto& visitor) {
    visitor.field("vocabulary", vocabulary, "file, or one that comes with the program");
    visitor.field("link", link, "wired, wifi, intermittent, or a file");
    visitor.field("settle_s", settle_s, {0.1, 600.0}, "[s] of quiet before the robot leaves");
  }
};

}  // namespace km
