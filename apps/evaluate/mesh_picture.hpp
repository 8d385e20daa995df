#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

#include "apps/evaluate/picture_view.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// One entry of a legend: a patch or a line of this colour, and its name.
struct LegendEntry {
  std::string name;
  cv::Vec3b color;  ///< Blue, green, red.
  bool is_line = false;
};

/// A white strip as wide as the view, with a scale bar and the entries in as many rows as
/// necessary. The bar has a length of 1, 2 or 5 times a power of ten metres and a label. In
/// perspective there is no bar, because there is no common scale.
[[nodiscard]] cv::Mat3b draw_legend(const std::vector<LegendEntry>& entries,
                                    const PictureView& view);

/// Colours of the surface.
enum class PictureColor {
  kLabel,  ///< The palette's colour of each label; unknown is grey.
  kShade,  ///< No colours, only shading.
  kOwn,    ///< Colours of the vertices.
  kRobot,  ///< One colour per mesh.
};

/// A path drawn over the surface, its start marked by a ring and its end by a disc.
struct PictureLine {
  std::string name;
  std::vector<Eigen::Vector3d> points;  ///< In the meshes' frame [m].
};

/// Content of a picture, all in one frame.
struct PictureScene {
  std::span<const LabelledMesh> meshes;
  std::vector<std::string> names;  ///< Names of the meshes.
  std::vector<PictureLine> lines;
  LabelPalette palette;
};

/// Shaded picture of the meshes from `view`. Below are a scale bar (parallel views only) and a
/// legend of the visible labels, of the meshes if these are coloured one by one, and of the lines.
/// The picture is as wide as the view, and higher by the legend. Throws std::invalid_argument if no
/// mesh has a face, and if a mesh lacks the requested labels or colours. Uses OpenCV's threads.
[[nodiscard]] cv::Mat3b draw_meshes(const PictureScene& scene, const PictureView& view,
                                    PictureColor color);

}  // namespace km
