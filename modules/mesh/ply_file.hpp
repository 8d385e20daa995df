#pragma once

#include <filesystem>
#include <stdexcept>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A mesh file that cannot be read or written. what() is one line that names the file and why.
struct MeshFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads a PLY file: ascii, binary little or big endian. Used are the properties x, y, z, red,
/// green, blue and label of `vertex`, and vertex_indices (or vertex_index) and label of `face`, all
/// of any scalar type; others are skipped. Polygons are cut into fans. Where only faces carry
/// labels, a vertex takes that of the last face it belongs to. Throws MeshFileError for a file that
/// is missing, truncated or not PLY, for coordinates that are not finite and for faces that name
/// vertices which do not exist.
[[nodiscard]] LabelledMesh read_ply(const std::filesystem::path& file);

/// Writes binary little endian PLY, read back unchanged by read_ply(): vertices as float, then
/// uchar red, green, blue and label where the mesh has them. See write_file(): whole or not at all.
/// Throws MeshFileError.
void write_ply(const std::filesystem::path& file, const LabelledMesh& mesh);

}  // namespace km
