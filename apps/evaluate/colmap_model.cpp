#include "apps/evaluate/colmap_model.hpp"

#include <sstream>
#include <stdexcept>

#include "modules/core/config.hpp"
#include "modules/core/write_file.hpp"

namespace km {
namespace {

constexpr double kPixelCentre_px = 0.5;

struct ColmapLens {
  const char* model;
  std::size_t coefficients;
};

ColmapLens colmap_lens(const Lens& lens) {
  if (lens.is_ideal()) return {"PINHOLE", 0};
  const std::size_t count = lens.coefficients().size();
  if (lens.model() == LensModel::kEquidistant) return {"OPENCV_FISHEYE", 4};
  if (lens.model() == LensModel::kRadialTangential)
    return count <= 4 ? ColmapLens{"OPENCV", 4} : ColmapLens{"FULL_OPENCV", 8};
  throw std::invalid_argument("COLMAP has no camera model for the lens \"" +
                              to_string(lens.model()) + "\"");
}

std::string cameras_text(const ColmapModel& model) {
  std::string text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (std::size_t i = 0; i < model.cameras.size(); ++i)
    text += colmap_camera(i + 1, model.cameras[i]);
  return text;
}

// Each image has two lines; the second one, with its points, is empty.
std::string images_text(const ColmapModel& model) {
  std::string text =
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, "
      "POINT3D_ID)\n";
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    const ColmapImage& image = model.images[i];
    const SE3 T_cam_world = image.T_world_cam.inverse();
    const Eigen::Quaterniond q(T_cam_world.linear());
    const Eigen::Vector3d& t = T_cam_world.translation();
    text += std::to_string(i + 1);
    for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()})
      text += ' ' + shortest_text(value);
    text += ' ' + std::to_string(image.camera + 1) + ' ' + image.name + "\n\n";
  }
  return text;
}

std::string points_text(const LabelledMesh& points) {
  std::ostringstream text;
  text << "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  for (std::size_t i = 0; i < points.vertices.size(); ++i) {
    text << i + 1;
    for (const float value : points.vertices[i]) text << ' ' << shortest_text(value);
    const auto color =
        points.colors.empty() ? LabelledMesh::Color{128, 128, 128} : points.colors[i];
    for (const std::uint8_t channel : color) text << ' ' << int{channel};
    text << " 0\n";
  }
  return text.str();
}

}  // namespace

std::string colmap_camera(std::size_t id, const Camera& camera) {
  const ColmapLens lens = colmap_lens(camera.lens);
  std::string text = std::to_string(id) + ' ' + lens.model + ' ' + std::to_string(camera.width) +
                     ' ' + std::to_string(camera.height);
  for (const double value :
       {camera.fx, camera.fy, camera.cx + kPixelCentre_px, camera.cy + kPixelCentre_px})
    text += ' ' + shortest_text(value);
  const auto known = camera.lens.coefficients();
  for (std::size_t i = 0; i < lens.coefficients; ++i)
    text += ' ' + shortest_text(i < known.size() ? known[i] : 0.0);
  return text + '\n';
}

void write_colmap(const std::filesystem::path& folder, const ColmapModel& model) {
  write_file(folder / "cameras.txt", cameras_text(model));
  write_file(folder / "images.txt", images_text(model));
  write_file(folder / "points3D.txt", points_text(model.points));
}

}  // namespace km
