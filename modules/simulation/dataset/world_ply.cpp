#include "modules/simulation/dataset/world_ply.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <string>

namespace km {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as it lies in memory");

std::string header(const SurfaceMesh& mesh) {
  return "ply\nformat binary_little_endian 1.0\ncomment frame world, metres, z up\n"
         "element vertex " +
         std::to_string(mesh.vertices.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nproperty uchar label\nproperty uchar red\n"
         "property uchar green\nproperty uchar blue\nend_header\n";
}

// Appends values as they lie in memory.
class Bytes {
 public:
  explicit Bytes(std::size_t capacity) { bytes_.reserve(capacity); }

  void add(const void* values, std::size_t size) {
    const std::size_t end = bytes_.size();
    bytes_.resize(end + size);
    std::memcpy(bytes_.data() + end, values, size);
  }

  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::vector<std::uint8_t> world_ply(const World& world, const LabelPalette& palette) {
  constexpr std::size_t kVertexSize = 12;
  constexpr std::size_t kFaceSize = 17;
  const SurfaceMesh& mesh = world.mesh;
  const std::string head = header(mesh);
  Bytes bytes(head.size() + kVertexSize * mesh.vertices.size() + kFaceSize * mesh.triangles.size());
  bytes.add(head.data(), head.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices) bytes.add(vertex.data(), kVertexSize);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto label = static_cast<LabelId>(world.materials.at(mesh.materials[i]).label);
    const LabelClass* const shown = palette.find(label);
    const std::array<std::uint8_t, 3> color =
        shown == nullptr ? std::array<std::uint8_t, 3>{} : shown->color;
    constexpr std::uint8_t kCorners = 3;
    bytes.add(&kCorners, 1);
    bytes.add(mesh.triangles[i].data(), 12);
    bytes.add(&label, 1);
    bytes.add(color.data(), 3);
  }
  return bytes.take();
}

}  // namespace km
