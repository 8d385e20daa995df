#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/map/label_palette.hpp"

namespace km {

/// Triangle mesh whose vertices have labels and colours. Each of these arrays is either empty
/// (unknown) or as long as `vertices`.
struct LabelledMesh {
  using Face = std::array<std::uint32_t, 3>;
  using Color = std::array<std::uint8_t, 3>;

  std::vector<Eigen::Vector3f> vertices;  ///< [m]
  std::vector<LabelId> labels;
  std::vector<Color> colors;  ///< red, green, blue
  std::vector<Face> faces;    ///< Counter-clockwise seen from free space.

  [[nodiscard]] bool empty() const { return vertices.empty(); }

  /// The label that two vertices of the face have, or else that of its first; 0 without labels.
  [[nodiscard]] LabelId face_label(std::size_t face) const;

  /// Normal of a face, with twice its area as length.
  [[nodiscard]] Eigen::Vector3f face_normal(std::size_t face) const;

  /// Appends `other`. An array that only one of the two meshes has is filled with zeros.
  void append(const LabelledMesh& other);

  /// Removes all vertices except for `kept`, which are ascending indices. Precondition: the faces
  /// have only vertices of `kept`.
  void keep_vertices(const std::vector<std::uint32_t>& kept);

  /// Moves every vertex: p_a = T_a_b * p_b.
  void transform(const SE3& T_a_b);

  /// Unit normals of the vertices: means of those of their faces, by area.
  [[nodiscard]] std::vector<Eigen::Vector3f> normals() const;

  /// Colours every vertex by its label's class; labels outside the palette become black.
  void colour_by(const LabelPalette& palette);
};

/// Appends `from` to `to`, two arrays with an element per vertex of two meshes. `to_size` and
/// `from_size` are the numbers of vertices. If only one of the arrays is empty, zeros replace it.
template <typename T>
void append_elements(std::vector<T>& to, std::size_t to_size, const std::vector<T>& from,
                     std::size_t from_size) {
  if (to.empty() && from.empty()) return;
  to.resize(to_size);
  to.insert(to.end(), from.begin(), from.end());
  to.resize(to_size + from_size);
}

/// Removes all elements of an array except for `kept`, which are ascending indices. An empty array
/// stays empty.
template <typename T>
void keep_elements(std::vector<T>& values, const std::vector<std::uint32_t>& kept) {
  if (values.empty()) return;
  for (std::size_t i = 0; i < kept.size(); ++i) values[i] = values[kept[i]];
  values.resize(kept.size());
}

}  // namespace km
