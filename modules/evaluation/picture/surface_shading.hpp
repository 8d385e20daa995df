#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "modules/evaluation/picture/picture_view.hpp"
#include "modules/evaluation/picture/surface_image.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

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
