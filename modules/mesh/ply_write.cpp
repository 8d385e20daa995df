#include <bit>
#include <fstream>
#include <string>
#include <system_error>

#include "modules/mesh/ply_file.hpp"

namespace km {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as it lies in memory");

template <typename T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string header(const LabelledMesh& mesh) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex ";
  text += std::to_string(mesh.vertices.size());
  text += "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!mesh.colors.empty())
    text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (!mesh.labels.empty()) text += "property uchar label\n";
  text += "element face " + std::to_string(mesh.faces.size());
  text += "\nproperty list uchar uint vertex_indices\nend_header\n";
  return text;
}

std::string encode(const LabelledMesh& mesh) {
  std::string bytes = header(mesh);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) put(bytes, mesh.vertices[i][axis]);
    if (!mesh.colors.empty()) put(bytes, mesh.colors[i]);
    if (!mesh.labels.empty()) put(bytes, mesh.labels[i]);
  }
  for (const auto& face : mesh.faces) {
    put(bytes, std::uint8_t{3});
    put(bytes, face);
  }
  return bytes;
}

}  // namespace

void write_ply(const std::filesystem::path& file, const LabelledMesh& mesh) {
  std::filesystem::path partial = file;
  partial += ".part";
  const std::string bytes = encode(mesh);
  std::ofstream stream(partial, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  std::error_code error;
  if (stream) std::filesystem::rename(partial, file, error);
  if (stream && !error) return;
  std::error_code ignored;
  std::filesystem::remove(partial, ignored);
  throw MeshFileError(file.string() + ": cannot be written" +
                      (error ? ": " + error.message() : " (no such folder, or the disk is full)"));
}

}  // namespace km
