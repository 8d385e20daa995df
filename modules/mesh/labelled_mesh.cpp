#include "modules/mesh/labelled_mesh.hpp"

namespace km {
namespace {

template <typename T>
void append_or_fill(std::vector<T>& to, std::size_t to_size, const std::vector<T>& from,
                    std::size_t from_size) {
  if (to.empty() && from.empty()) return;
  to.resize(to_size);
  to.insert(to.end(), from.begin(), from.end());
  to.resize(to_size + from_size);
}

}  // namespace

LabelId LabelledMesh::face_label(std::size_t face) const {
  if (labels.empty()) return 0;
  const auto [a, b, c] = faces[face];
  return labels[b] == labels[c] ? labels[b] : labels[a];
}

void LabelledMesh::append(const LabelledMesh& other) {
  const std::size_t count = vertices.size();
  append_or_fill(labels, count, other.labels, other.vertices.size());
  append_or_fill(colors, count, other.colors, other.vertices.size());
  vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  faces.reserve(faces.size() + other.faces.size());
  const auto offset = static_cast<std::uint32_t>(count);
  for (const auto& [a, b, c] : other.faces) faces.push_back({a + offset, b + offset, c + offset});
}

void LabelledMesh::transform(const SE3& T_a_b) {
  const Eigen::Isometry3f T = T_a_b.cast<float>();
  for (auto& vertex : vertices) vertex = T * vertex;
}

void LabelledMesh::colour_by(const LabelPalette& palette) {
  colors.assign(vertices.size(), Color{0, 0, 0});
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (const LabelClass* found = palette.find(labels[i])) colors[i] = found->color;
}

}  // namespace km
