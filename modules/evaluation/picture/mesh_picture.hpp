#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

#include "modules/core/label_palette.hpp"
#include "modules/evaluation/picture/picture_view.hpp"
#include "modules/evaluation/picture/surface_image.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// One entry of a legend: a patch or a line of this colour, and its name.
struct LegendEntry {
  std::string name;
  cv::Vec3b color;  ///< Blue, green, red.
  bool is_line = false;
};

/// A white strip as wide as the view: a bar of 1, 2 or 5 times a power of ten metres with its
/// length (not in perspective, where there is no one scale), and the entries, in as many rows as
/// they need.
[[nodiscard]] cv::Mat3b draw_legend(const std::vector<LegendEntry>& entries,
                                    const PictureView& view);

/// What colours the surface.
enum class PictureColor {
  kLabel,  ///< The palette's colour of each label; unknown is grey.
  kShade,  ///< None: shape only.
  kOwn,    ///< The vertices' own.
  kRobot,  ///< One per mesh.
};

/// A path drawn over the surface, its start marked by a ring and its end by a disc.
struct PictureLine {
  std::string name;
  std::vector<Eigen::Vector3d> points;  ///< In the meshes' frame [m].
};

/// What is in a picture. All in one frame.
struct PictureScene {
  std::span<const LabelledMesh> meshes;
  std::vector<std::string> names;  ///< Of the meshes.
  std::vector<PictureLine> lines;
  LabelPalette palette;
};

struct PictureOptions {
  PictureColor color = PictureColor::kLabel;
  SurfaceCut cut;
  double occlusion_m = 0.8;  ///< How far around a point its light is looked for.
};

/// Shaded picture of the meshes from `view` and, below, a scale bar (parallel views only) and a
/// legend of the labels in sight, the meshes if coloured one by one, and the lines. As wide as the
/// view; higher by the legend. Throws std::invalid_argument if no mesh has a face, and for colours
/// that a mesh does not have: labels, its own. Uses OpenCV's threads.
[[nodiscard]] cv::Mat3b draw_meshes(const PictureScene& scene, const PictureView& view,
                                    const PictureOptions& options = {});

}  // namespace km
