#pragma once

#include <filesystem>

#include "modules/mesh/mesh_file.hpp"

namespace km {

/// Reads a PLY file: ascii, binary little or big endian. It uses the properties x, y, z, red,
/// green, blue and label of `vertex`, and vertex_indices (or vertex_index) and label of `face`, all
/// of any scalar type. Other properties are skipped. Polygons are divided into fans. If only faces
/// have labels, a vertex gets the label of its last face. Throws MeshFileError for a file that is
/// missing, truncated or not PLY, for coordinates that are not finite, and for faces with vertices
/// that do not exist.
[[nodiscard]] LabelledMesh read_ply(const std::filesystem::path& file);

/// Writes binary little endian PLY, which read_ply() reads back unchanged: vertices as float, then
/// uchar red, green, blue and label if the mesh has them. A failure leaves no partial file (see
/// write_file()). Throws MeshFileError.
void write_ply(const std::filesystem::path& file, const LabelledMesh& mesh);

}  // namespace km
