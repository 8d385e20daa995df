#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/core/data/pose_graph.hpp"

namespace km {

/// Keyframes such that each closure ends on at least one of them. Ascending, and independent of the
/// order of the closures. Greedy vertex cover: the keyframe with the most uncovered closures is
/// taken next, and the smallest id decides a tie. At the end, superfluous keyframes are removed.
/// O(closures log closures).
[[nodiscard]] std::vector<KeyframeId> cover_closures(std::span<const ClosureId> closures);

/// True for the closures between `self` and `peer` that `self` weighs; `peer` weighs the others.
///
/// `child`: the one of both that is a child of the other in the tree, if any. The parent then
/// weighs all closures if these end on at most 1.5 times as many poses of the child as a cover has.
/// The second derivatives of the child then do not change with weights and are sent once. In other
/// pairs the cover chooses an end of each closure, equal on both robots.
[[nodiscard]] std::vector<bool> weighed_closures(std::span<const ClosureId> closures, RobotId self,
                                                 RobotId peer, std::optional<RobotId> child);

}  // namespace km
