#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/superseded_surface.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// When an older piece of surface and a newer one are the same.
struct SameSurface {
  double distance_m = 0.1;      ///< Of the old vertex from the new face at most, along its normal.
  double longest_edge_m = 0.2;  ///< Newer faces with longer ones may be overlooked.
  KeyframeIndex window_keyframes = 0;  ///< The new face was first seen more than this later.
};

/// For each vertex of a corrected mesh the one that stands for its surface since a later visit, or
/// kNoIndex for those that stay. A vertex has an heir if a newer face that stays lies within the
/// distance, is met by the vertex's normal inside its triangle (or within a quarter of the distance
/// of it), and is turned by at most 60 degrees against the vertex: the other side of a wall is
/// another surface. The heir is the nearest corner of the nearest such face. A face stays unless
/// all its vertices have heirs: what was seen once only, and the rim of it, is never lost.
///
/// Faces are judged from the newest to the oldest, so that what supersedes stays. `mesh` [m] and
/// `seen_by` have equal length. n log n.
[[nodiscard]] std::vector<std::uint32_t> find_heirs(const LabelledMesh& mesh,
                                                    std::span<const SeenBy> seen_by,
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
