#pragma once

#include <filesystem>

#include "modules/mesh/map_mesh.hpp"

namespace km {

/// Writes a map as it is, to the last bit, with a check sum. Throws std::system_error as
/// write_file() does.
void write_map_file(const std::filesystem::path& file, const MapMesh& map);

/// Reads what write_map_file() wrote. Throws InputFileError for everything else: faces and views
/// are of vertices that there are, positions finite, ids ascending.
[[nodiscard]] MapMesh read_map_file(const std::filesystem::path& file);

}  // namespace km
