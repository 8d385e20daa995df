#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/robust/frame_alignment.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// Moves `poses` of robot `self` as a whole from its own frame into the frame of the `received`
/// poses of other robots. The transform is the one on which most of the `closures` to these poses
/// agree, see align_frames(). Candidates are compared at the centre of the closure ends on `self`.
/// nullopt if no closure ends on a received pose.
[[nodiscard]] std::optional<std::vector<SE3>> moved_into_frame(
    const std::vector<SE3>& poses, RobotId self, std::span<const PoseEdge> closures,
    const std::map<KeyframeId, SE3>& received);

/// Deforms `poses`, in the frame of the `received` poses, by solve_alone() on the own edges
/// and on the closures to received poses, which stay fixed. A long odometry drifts so far that no
/// rigid transform fits. The closures must be true, because false ones would deform the trajectory.
[[nodiscard]] std::vector<SE3> deformed_to_received(const std::vector<SE3>& poses, RobotId self,
                                                    std::span<const PoseEdge> own,
                                                    std::span<const PoseEdge> closures,
                                                    const std::map<KeyframeId, SE3>& received);

}  // namespace km
