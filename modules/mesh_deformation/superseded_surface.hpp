#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh_deformation/mesh_node.hpp"

namespace km {

/// Criteria for two parts of a mesh to show the same surface.
struct SameSurface {
  /// Largest distance of a vertex of one part from a face of the other part, along the normal of
  /// the face.
  double distance_m = 0.1;
  double longest_edge_m = 0.2;          ///< Faces with longer edges may be missed.
  KeyframeIndex max_gap_keyframes = 0;  ///< Largest keyframe_gap() within one visit.
  std::size_t copies = 1;               ///< Number of copies of a surface that stay.
};

/// MapMesh::seen_by and MapMesh::certainty of the vertices of a mesh. `certainty` may be empty.
struct SurfaceViews {
  std::span<const SeenBy> seen_by;
  std::span<const std::uint8_t> certainty;
};

/// For each vertex of a corrected mesh the vertex that replaces it, or kNoIndex for a vertex that
/// stays. The most certain copies of a surface stay, or the newest of equally certain ones.
///
/// A vertex has a replacement if faces of SameSurface::copies other visits stay that have a higher
/// rank (certainty, then time) and meet three conditions. The plane of the face is within
/// SameSurface::distance_m of the vertex. The projection of the vertex onto this plane is inside
/// the triangle, or at most a quarter of that distance beside it. Its normal differs from that of
/// the vertex by at most 60 degrees, because the other side of a wall is another surface. The
/// replacement is the nearest corner of the nearest such face.
///
/// Certainties of neighbours differ by chance. They are compared as averages over the surface
/// within about six edges, rounded, so that large parts of the same visits stay.
///
/// A face stays unless all its vertices have replacements, so that surface seen only once stays
/// with its rim. Noise leaves scraps of few faces in the middle of a copy with replacements. A
/// scrap of fewer than eight faces is replaced like the surface around it.
///
/// Faces are judged by descending rank, so that a superseding face stays. `mesh` [m]. n log n.
[[nodiscard]] std::vector<std::uint32_t> find_replacements(const LabelledMesh& mesh,
                                                           const SurfaceViews& views,
                                                           const SameSurface& same);

/// True if all corners have replacements.
[[nodiscard]] inline bool is_superseded(const LabelledMesh::Face& face,
                                        std::span<const std::uint32_t> replacements) {
  return replacements[face[0]] != kNoIndex && replacements[face[1]] != kNoIndex &&
         replacements[face[2]] != kNoIndex;
}

/// The vertices of without_superseded(), as ascending indices in `mesh`.
[[nodiscard]] std::vector<std::uint32_t> remaining_vertices(
    const LabelledMesh& mesh, std::span<const std::uint32_t> replacements);

/// The mesh without its superseded faces and without vertices that had no other faces; the order is
/// kept.
[[nodiscard]] LabelledMesh without_superseded(const LabelledMesh& mesh,
                                              std::span<const std::uint32_t> replacements);

/// `replacements` with ids in place of indices. `ids` are those of the vertices, ascending.
[[nodiscard]] SupersededSurface named(std::span<const std::uint32_t> replacements,
                                      std::span<const std::uint64_t> ids);

}  // namespace km
