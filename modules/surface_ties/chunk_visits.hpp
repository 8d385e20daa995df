#pragma once

#include <vector>

#include "modules/mesh/mesh_chunks.hpp"
#include "modules/mesh/seen_by.hpp"

namespace km {

/// First and last keyframe of the views of all vertices. Precondition: the chunk has keyframes and
/// vertices.
[[nodiscard]] SeenBy seen_by(const MeshChunk& chunk);

/// Splits a chunk into the surfaces of different visits, ordered by time. Each of them is a chunk
/// with the same key. The keyframe_gap() of a vertex to the first vertex of its visit is at most
/// `max_gap_keyframes`. Local Mesh Optimization moves the surfaces of larger gaps independently of
/// each other. Faces between two visits are left out, so that each surface states one visit only.
/// Preconditions: fault_of() finds no fault, and the chunk has keyframes. O(n log n) for few
/// visits.
[[nodiscard]] std::vector<MeshChunk> split_visits(const MeshChunk& chunk,
                                                  KeyframeIndex max_gap_keyframes);

}  // namespace km
