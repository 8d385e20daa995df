#pragma once

#include <optional>
#include <span>

#include "modules/core/pose_graph.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// What has become of a pair of keyframes.
struct ToldClosure {
  ClosureId id;
  ClosureStage stage = ClosureStage::kCandidate;
  bool rejected = false;         ///< Verified, but others contradict it.
  std::optional<SE3> T_from_to;  ///< Between those of `id`, where it was measured.
};

/// Closures as lines between keyframes, one marker each of those that are candidates (grey),
/// verified (yellow), rejected (red) and kept (green): all four, so that what is there no more
/// goes. The end of a line at another robot's keyframe is where the closure puts it; one that was
/// not measured is not drawn then, nor are keyframes that `trajectory` does not have.
[[nodiscard]] RosMarkers closure_lines(std::span<const ToldClosure> closures,
                                       const Trajectory& trajectory, const RosHeader& header);

}  // namespace km
