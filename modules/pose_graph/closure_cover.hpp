#pragma once

#include <span>
#include <vector>

#include "modules/core/pose_graph.hpp"

namespace km {

/// Keyframes such that each closure has one of them at an end. Ascending, and the same for the same
/// closures in whatever order. Greedy vertex cover: the keyframe with most closures left comes
/// next, the smaller one among equals; in the end those are left out that turned out to be
/// superfluous. O(closures log closures).
[[nodiscard]] std::vector<KeyframeId> cover_closures(std::span<const ClosureId> closures);

}  // namespace km
