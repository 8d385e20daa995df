#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/frame_alignment.hpp"
#include "modules/pose_graph/pose_edge.hpp"

namespace km {

/// `poses` of robot `self`, in a frame of its own, moved as a whole into the frame of the poses
/// `told` by others: the transform that most of `closures` to those agree on, see align_frames().
/// Candidates are compared at the centre of the closures' own ends. nullopt if no closure ends on a
/// told pose.
[[nodiscard]] std::optional<std::vector<SE3>> moved_into_frame(
    const std::vector<SE3>& poses, RobotId self, std::span<const PoseEdge> closures,
    const std::map<KeyframeId, SE3>& told, const AlignmentTolerance& tolerance);

/// `poses`, in the frame of those `told`, bent by some Newton steps on their own edges and on the
/// closures to told ones, which stay fixed: over a long odometry no rigid transform fits. False
/// closures would bend it wrongly.
[[nodiscard]] std::vector<SE3> bent_to_told(const std::vector<SE3>& poses, RobotId self,
                                            std::span<const PoseEdge> own,
                                            std::span<const PoseEdge> closures,
                                            const std::map<KeyframeId, SE3>& told);

/// Of `poses` and chordal initialisation from the robot's own edges, begun at the first of `poses`,
/// what costs less. Throws std::invalid_argument if `own` does not connect all poses.
[[nodiscard]] std::vector<SE3> better_of_chordal(std::vector<SE3> poses,
                                                 std::span<const PoseEdge> own);

}  // namespace km
