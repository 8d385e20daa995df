#pragma once

#include <optional>
#include <span>

#include "modules/core/closure_verdicts.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {

/// Present state of a closure candidate, for publication.
struct PublishedClosure {
  ClosureId id;
  ClosureStatus status = ClosureStatus::kCandidate;
  std::optional<SE3> T_from_to;  ///< Measured transform between the keyframes of `id`, if there is
                                 ///< one.
};

/// Draws closures as lines between keyframes, with one marker for each status: candidates (grey),
/// verified (yellow), rejected (red) and kept (green). It always returns all four markers, so that
/// viewers remove old lines. A line to a keyframe of another robot ends where the closure places
/// that keyframe. Lines to keyframes without a known pose are omitted.
[[nodiscard]] RosMarkerArray closure_lines(std::span<const PublishedClosure> closures,
                                           const Trajectory& trajectory, const RosHeader& header);

}  // namespace km
