#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "apps/evaluate/picture_view.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// The nearest face at each pixel's centre, row by row.
struct SurfaceImage {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  int width = 0;
  int height = 0;
  std::vector<float> depth_m;        ///< Along the view's z; infinite without a face.
  std::vector<std::uint32_t> faces;  ///< kNone without a face.

  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(column);
  }
};

/// Draws the faces that are seen from their front into a depth buffer, so that one can look into a
/// room through its ceiling. O(faces + pixels covered).
[[nodiscard]] SurfaceImage rasterise(const LabelledMesh& mesh, const PictureView& view);

/// Colours of the surface without light: blue, green, red, one per pixel; white without a face.
/// `vertex_colors` is as long as the mesh's vertices. With `blend`, colours are interpolated
/// between the corners. Otherwise a pixel has the colour of the nearest corner.
[[nodiscard]] cv::Mat3b paint(const LabelledMesh& mesh, const SurfaceImage& surface,
                              const PictureView& view,
                              const std::vector<LabelledMesh::Color>& vertex_colors, bool blend);

/// Shows the shape by light from the upper left, ambient occlusion (surface in a corner or close
/// below other surface is darker), and lines at jumps of depth.
void shade(cv::Mat3b& picture, const LabelledMesh& mesh, const SurfaceImage& surface,
           const PictureView& view);

}  // namespace km
