#pragma once

#include <cstdint>

#include "modules/core/keyframe.hpp"

namespace km {

/// Asks the owner of `keyframe` for its odometry, points and descriptors, of which those come that
/// keyframe `own` of the requester may show, too.
struct KeyframeRequest {
  RobotId requester = 0;
  std::uint32_t number = 0;  ///< Counts the requester's requests.
  KeyframeId keyframe;
  KeyframeIndex own = 0;
};

/// The answer. `found` is false where the owner has no such keyframe (yet): then only the
/// keyframe's id is set.
struct KeyframeReply {
  std::uint32_t number = 0;  ///< Of the request.
  bool found = false;
  Keyframe keyframe;
};

}  // namespace km
