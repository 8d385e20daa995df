#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <opencv2/core/mat.hpp>
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

/// Colours of the surface before light falls on it: blue, green, red, one per pixel; white where
/// there is no face. `vertex_colors` is as long as the mesh's vertices. With `blend`, colours go
/// over from corner to corner, else a pixel has that of the corner it is most of.
[[nodiscard]] cv::Mat3b paint(const LabelledMesh& mesh, const SurfaceImage& surface,
                              const PictureView& view,
                              const std::vector<LabelledMesh::Color>& vertex_colors, bool blend);

/// Makes the shape visible: light from the upper left, ambient occlusion over `occlusion_m` (what
/// is in a corner or close below something is darker), and lines where depth jumps.
void shade(cv::Mat3b& picture, const LabelledMesh& mesh, const SurfaceImage& surface,
           const PictureView& view, double occlusion_m);

}  // namespace km
