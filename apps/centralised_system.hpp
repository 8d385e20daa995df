#pragma once

#include <string_view>

namespace km {

// The bytes of a team are compared with those that the server of a centralised system would
// receive: each keyframe once, with so many keypoints.

/// Bytes of a keypoint at the server: 8 of position and 32 of ORB descriptor.
inline constexpr double kKeypointBytes = 40.0;

/// Category of the team's traffic that is not counted, because keypoints do not show the map.
inline constexpr std::string_view kMapTraffic = "map";

}  // namespace km
