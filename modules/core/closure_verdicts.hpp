#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "modules/core/pose_graph.hpp"

namespace km {

struct WeighedClosure {
  ClosureId id;
  bool kept = true;
};

/// Results of graduated non-convexity for a robot's closures of one session. The latest result of
/// each closure counts.
struct ClosureVerdicts {
  std::vector<WeighedClosure> closures;

  [[nodiscard]] std::size_t rejected() const {
    return static_cast<std::size_t>(
        std::count_if(closures.begin(), closures.end(), [](const auto& c) { return !c.kept; }));
  }
};

}  // namespace km
