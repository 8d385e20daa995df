#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/mesh/labelled_mesh.hpp"

namespace km {

/// An image of a COLMAP model.
struct ColmapImage {
  std::string name;        ///< Path relative to the folder of images.
  std::size_t camera = 0;  ///< Index of its camera.
  SE3 T_world_cam = SE3::Identity();
};

/// A sparse model in the text format of COLMAP (colmap.github.io/format.html).
struct ColmapModel {
  std::vector<Camera> cameras;
  std::vector<ColmapImage> images;
  LabelledMesh points;  ///< Vertices and their colours; grey without colours. Faces are not used.
};

/// Line of cameras.txt: radial-tangential lenses become PINHOLE (without distortion), OPENCV (up to
/// 4 coefficients) or FULL_OPENCV, equidistant ones OPENCV_FISHEYE. COLMAP's pixel centres are at
/// 0.5, so its principal point is half a pixel larger. Throws std::invalid_argument for a lens that
/// COLMAP lacks.
[[nodiscard]] std::string colmap_camera(std::size_t id, const Camera& camera);

/// Writes cameras.txt, images.txt and points3D.txt to `folder`, which exists. Numbers of cameras,
/// images and points begin with 1. Poses are from world to camera, quaternions w x y z. Points have
/// no tracks. Throws std::system_error for a file that cannot be written.
void write_colmap(const std::filesystem::path& folder, const ColmapModel& model);

}  // namespace km
