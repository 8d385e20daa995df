#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "modules/evaluation/picture/picture_view.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// The nearest face in each pixel's centre, row by row.
struct SurfaceImage {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  int width = 0;
  int height = 0;
  std::vector<float> depth_m;        ///< Along the view's z; infinite where there is no face.
  std::vector<std::uint32_t> faces;  ///< kNone where there is no face.

  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(column);
  }
};

/// What is not drawn.
struct SurfaceCut {
  bool back_faces = false;  ///< Faces seen from behind: a room is looked into through its ceiling.
  double above_m = std::numeric_limits<double>::infinity();  ///< All that has a larger z.
};

/// Draws the faces into a depth buffer. O(faces + pixels covered).
[[nodiscard]] SurfaceImage rasterise(const LabelledMesh& mesh, const PictureView& view,
                                     const SurfaceCut& cut = {});

}  // namespace km
