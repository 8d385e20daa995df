#pragma once

#include <filesystem>
#include <span>
#include <stdexcept>
#include <string_view>

#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// A mesh file that cannot be read or written. what() is one line with the file and the reason.
struct MeshFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file format of meshes. Both functions throw MeshFileError.
struct MeshFormat {
  std::string_view extension;  ///< ".ply"
  LabelledMesh (*read)(const std::filesystem::path& file);
  void (*write)(const std::filesystem::path& file, const LabelledMesh& mesh);
};

/// All formats. The first one is PLY, in which robots write.
[[nodiscard]] std::span<const MeshFormat> mesh_formats();

/// Reads a mesh in the format of the file's extension, or as PLY if no format has this extension.
/// Throws MeshFileError.
[[nodiscard]] LabelledMesh read_mesh(const std::filesystem::path& file);

/// Writes a mesh in the format of the file's extension. Throws MeshFileError, also for an extension
/// that no format has.
void write_mesh(const std::filesystem::path& file, const LabelledMesh& mesh);

}  // namespace km
