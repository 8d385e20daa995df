#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// Reads a PLY file: ascii, binary little or big endian. It uses the properties x, y, z, red,
/// green, blue and label of `vertex`, and vertex_indices (or vertex_index) and label of `face`, all
/// of any scalar type. Other properties are skipped. Polygons are divided into fans. If only faces
/// have labels, a vertex gets the label of its last face. Throws InputFileError for a file that is
/// missing, truncated or not PLY, for coordinates that are not finite, and for faces with vertices
/// that do not exist.
[[nodiscard]] LabelledMesh read_mesh(const std::filesystem::path& file);

/// `mesh` for a view, without vertices far away and their faces, which would make a picture empty.
/// Far is beyond 100 times the size of the box of the quartiles, from its middle. `notes` gets one
/// line about `name` if there are any.
[[nodiscard]] LabelledMesh without_far_vertices(LabelledMesh mesh, const std::string& name,
                                                std::vector<std::string>& notes);

/// Writes binary little endian PLY, which read_mesh() reads back unchanged: vertices as float, then
/// uchar red, green, blue and label if the mesh has them. Throws std::invalid_argument for another
/// extension than .ply, and std::system_error under the conditions of write_file(). Then it leaves
/// no partial file.
void write_mesh(const std::filesystem::path& file, const LabelledMesh& mesh);

}  // namespace km
