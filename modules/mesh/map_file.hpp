#pragma once

#include <filesystem>

#include "modules/mesh/map_mesh.hpp"

namespace km {

/// Writes a map bit by bit with a check sum. Throws std::system_error under the conditions of
/// write_file().
void write_map_file(const std::filesystem::path& file, const MapMesh& map);

/// Reads a file of write_map_file(). Throws InputFileError for any other content: faces and views
/// must refer to existing vertices, positions must be finite, ids ascending.
[[nodiscard]] MapMesh read_map_file(const std::filesystem::path& file);

}  // namespace km
