#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A file format of meshes.
struct MeshFormat {
  std::string_view extension;  ///< ".ply"
  /// Throws InputFileError. The other function throws std::system_error.
  LabelledMesh (*read)(const std::filesystem::path& file);
  void (*write)(const std::filesystem::path& file, const LabelledMesh& mesh);
};

/// All formats. The first one is PLY, in which robots write.
[[nodiscard]] std::span<const MeshFormat> mesh_formats();

/// Reads a mesh in the format of the file's extension, or as PLY if no format has this extension.
/// Throws InputFileError.
[[nodiscard]] LabelledMesh read_mesh(const std::filesystem::path& file);

/// Writes a mesh in the format of the file's extension. Throws std::system_error if it cannot be
/// written, and std::invalid_argument for an extension that no format has.
void write_mesh(const std::filesystem::path& file, const LabelledMesh& mesh);

}  // namespace km
