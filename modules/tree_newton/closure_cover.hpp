#pragma once

#include <span>
#include <vector>

#include "modules/core/pose_graph.hpp"

namespace km {

/// Keyframes such that each closure ends on at least one of them. Ascending, and independent of the
/// order of the closures. Greedy vertex cover: the keyframe with the most uncovered closures is
/// taken next, and the smallest id decides a tie. At the end, superfluous keyframes are removed.
/// O(closures log closures).
[[nodiscard]] std::vector<KeyframeId> cover_closures(std::span<const ClosureId> closures);

}  // namespace km
