#pragma once

#include <vector>

#include "modules/core/ids.hpp"
#include "modules/rbcd/stiefel.hpp"

namespace km {

/// Poses that one robot sends to the others.
struct SentPoses {
  std::vector<KeyframeIndex> keyframes = {};  ///< Ascending.
  LiftedPoses X = {};                         ///< r x 4 per keyframe.
};

}  // namespace km
