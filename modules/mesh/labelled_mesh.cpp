#include "modules/mesh/labelled_mesh.hpp"

#include <Eigen/Geometry>

namespace km {
LabelId LabelledMesh::face_label(std::size_t face) const {
  if (labels.empty()) return 0;
  const auto [a, b, c] = faces[face];
  return labels[b] == labels[c] ? labels[b] : labels[a];
}

Eigen::Vector3f LabelledMesh::face_normal(std::size_t face) const {
  const auto [a, b, c] = faces[face];
  return (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
}

void LabelledMesh::append(const LabelledMesh& other) {
  const std::size_t count = vertices.size();
  append_elements(labels, count, other.labels, other.vertices.size());
  append_elements(colors, count, other.colors, other.vertices.size());
  vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  faces.reserve(faces.size() + other.faces.size());
  const auto offset = static_cast<std::uint32_t>(count);
  for (const auto& [a, b, c] : other.faces) faces.push_back({a + offset, b + offset, c + offset});
}

void LabelledMesh::keep_vertices(const std::vector<std::uint32_t>& kept) {
  std::vector<std::uint32_t> place(vertices.size(), 0);
  for (std::uint32_t i = 0; i < kept.size(); ++i) place[kept[i]] = i;
  keep_elements(vertices, kept);
  keep_elements(labels, kept);
  keep_elements(colors, kept);
  for (Face& face : faces)
    for (std::uint32_t& vertex : face) vertex = place[vertex];
}

void LabelledMesh::transform(const SE3& T_a_b) {
  const Eigen::Isometry3f T = T_a_b.cast<float>();
  for (auto& vertex : vertices) vertex = T * vertex;
}

std::vector<Eigen::Vector3f> LabelledMesh::normals() const {
  std::vector<Eigen::Vector3f> result(vertices.size(), Eigen::Vector3f::Zero());
  for (std::size_t face = 0; face < faces.size(); ++face)
    for (const std::uint32_t v : faces[face]) result[v] += face_normal(face);
  for (Eigen::Vector3f& normal : result) normal.normalize();
  return result;
}

void LabelledMesh::colour_by(const LabelPalette& palette) {
  colors.assign(vertices.size(), Color{0, 0, 0});
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (const LabelClass* found = palette.find(labels[i])) colors[i] = found->color;
}

}  // namespace km
