#pragma once

#include <filesystem>

#include "modules/mesh/map_mesh.hpp"

namespace km {

/// Writes a map bit by bit with a check sum. Throws std::system_error under the conditions of
/// write_file().
void write_map_file(const std::filesystem::path& file, const MapMesh& map);

/// Reads a file of write_map_file(). Throws InputFileError for other content or a wrong check sum.
/// Also throws it for a face with a vertex that does not exist, arrays of wrong length, positions
/// that are not finite, and ids that do not ascend.
[[nodiscard]] MapMesh read_map_file(const std::filesystem::path& file);

}  // namespace km
