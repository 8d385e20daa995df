#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Rounds of a filter that smooths a surface and keeps its edges (Sun, Rosin, Martin and Langbein,
/// "Fast and Effective Feature-Preserving Mesh Denoising", 2007). A bilateral filter smooths the
/// normals of faces; unlike there, its weights also contain the areas. Vertices then follow the
/// normals.
///
/// A vertex depends on the faces within kFilterRings rings around it only. Equal surroundings give
/// equal results.
inline constexpr int kNormalRounds = 10, kVertexRounds = 12;
inline constexpr int kFilterRings = kNormalRounds + kVertexRounds;

/// The filtered positions of all vertices. Time proportional to the faces.
[[nodiscard]] std::vector<Eigen::Vector3f> filter_surface(
    const std::vector<Eigen::Vector3f>& vertices, std::span<const LabelledMesh::Face> faces);

/// Updates `filtered`, the result for an earlier state of the mesh, near the vertices that have
/// `changed`, or whose faces have.
void filter_surface(const std::vector<Eigen::Vector3f>& vertices,
                    std::span<const LabelledMesh::Face> faces,
                    const std::vector<std::uint32_t>& changed,
                    std::vector<Eigen::Vector3f>& filtered);

}  // namespace km
