#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/label_palette.hpp"

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

  /// Appends `other`. An array that only one of the two meshes has is filled with zeros.
  void append(const LabelledMesh& other);

  /// Moves every vertex: p_a = T_a_b * p_b.
  void transform(const SE3& T_a_b);

  /// Colours every vertex by its label's class; labels outside the palette become black.
  void colour_by(const LabelPalette& palette);
};

}  // namespace km
