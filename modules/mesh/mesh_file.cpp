#include "modules/mesh/mesh_file.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "modules/mesh/ply_file.hpp"

namespace km {
namespace {

constexpr std::array<MeshFormat, 1> kFormats = {{{".ply", read_ply, write_ply}}};

const MeshFormat* format_of(const std::filesystem::path& file) {
  const auto found = std::ranges::find(kFormats, file.extension().string(), &MeshFormat::extension);
  return found == kFormats.end() ? nullptr : &*found;
}

}  // namespace

std::span<const MeshFormat> mesh_formats() {
  return kFormats;
}

LabelledMesh read_mesh(const std::filesystem::path& file) {
  const MeshFormat* const format = format_of(file);
  return (format != nullptr ? *format : kFormats.front()).read(file);
}

void write_mesh(const std::filesystem::path& file, const LabelledMesh& mesh) {
  const MeshFormat* const format = format_of(file);
  if (format != nullptr) return format->write(file, mesh);
  std::string known;
  for (const MeshFormat& each : kFormats) known.append(" ").append(each.extension);
  throw std::invalid_argument(file.string() + ": the extension is none of" + known);
}

}  // namespace km
