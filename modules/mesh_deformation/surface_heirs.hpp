#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// When two pieces of surface are the same.
struct SameSurface {
  double distance_m = 0.1;      ///< Of a vertex from a face of the other at most, along its normal.
  double longest_edge_m = 0.2;  ///< Faces with longer ones may be overlooked.
  KeyframeIndex window_keyframes = 0;  ///< Seen no further apart in time, they are one visit's.
};

/// When and how well the vertices of a mesh were seen: see MapMesh. Views of equal length, but that
/// `certainty` may be empty.
struct Sightings {
  std::span<const SeenBy> seen_by;
  std::span<const std::uint8_t> certainty;
};

/// For each vertex of a corrected mesh the one that stands for its surface, or kNoIndex for those
/// that stay. Of the copies of a surface that several visits made the most certain one stays, of
/// equally certain ones the newest. A vertex has an heir if a face of another visit that stays and
/// ranks higher lies within the distance, is met by the normal through the vertex inside its
/// triangle (or within a quarter of the distance of it), and is turned by at most 60 degrees
/// against the vertex: the other side of a wall is another surface. The heir is the nearest corner
/// of the nearest such face. A face stays unless all its vertices have heirs: what was seen once
/// only, and the rim of it, is never lost.
///
/// Faces are judged by falling rank, so that what supersedes stays. `mesh` [m]. n log n.
[[nodiscard]] std::vector<std::uint32_t> find_heirs(const LabelledMesh& mesh,
                                                    const Sightings& sightings,
                                                    const SameSurface& same);

/// True if all corners have heirs.
[[nodiscard]] inline bool is_superseded(const LabelledMesh::Face& face,
                                        std::span<const std::uint32_t> heirs) {
  return heirs[face[0]] != kNoIndex && heirs[face[1]] != kNoIndex && heirs[face[2]] != kNoIndex;
}

/// The mesh without its superseded faces, and without vertices that had no others; order is kept.
[[nodiscard]] LabelledMesh without_superseded(const LabelledMesh& mesh,
                                              std::span<const std::uint32_t> heirs);

/// The heirs by name. `ids` are the vertices', ascending.
[[nodiscard]] SupersededSurface named(std::span<const std::uint32_t> heirs,
                                      std::span<const std::uint64_t> ids);

}  // namespace km
