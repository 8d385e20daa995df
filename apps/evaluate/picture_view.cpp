#include "apps/evaluate/picture_view.hpp"

#include <CLI/Error.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <sstream>
#include <vector>

namespace km {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kFieldOfView = 80.0 * kRadians;
constexpr double kOblique = 40.0 * kRadians;  // elevation of the viewer
constexpr double kMargin = 1.04;              // size of the picture relative to its content
constexpr double kStray = 0.002;              // share of the vertices ignored on each side

// The rotation of a camera that looks along `forward`, with `up` upwards in its picture.
Eigen::Matrix3d looking(const Eigen::Vector3d& forward, const Eigen::Vector3d& up) {
  Eigen::Matrix3d R_cam_world;
  R_cam_world.row(0) = forward.cross(up).normalized();
  R_cam_world.row(2) = forward.normalized();
  R_cam_world.row(1) = R_cam_world.row(2).cross(R_cam_world.row(0));
  return R_cam_world;
}

// Parallel view that the box just fills, with all of it in front.
PictureView filled(const Eigen::AlignedBox3d& extent, const Eigen::Matrix3d& R_cam_world, int width,
                   int height) {
  Eigen::AlignedBox3d box;
  for (int i = 0; i < 8; ++i)
    box.extend(R_cam_world * extent.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
  PictureView view{.width = width, .height = height};
  const Eigen::Vector3d size = kMargin * box.sizes().cwiseMax(1e-3);
  view.scale = std::min(width / size.x(), height / size.y());
  const Eigen::Vector3d centre = box.center();
  view.T_cam_world =
      make_pose(R_cam_world, {-centre.x(), -centre.y(), 1.0 - box.min().z() + box.sizes().z()});
  return view;
}

// The pose of a camera from "x,y,z,yaw,pitch".
std::optional<SE3> pose_in(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream stream(text);
  for (std::string word; std::getline(stream, word, ',');) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (word.empty() || *end != '\0' || !std::isfinite(numbers.back())) return std::nullopt;
  }
  if (numbers.size() != 5) return std::nullopt;
  const double yaw = numbers[3] * kRadians, pitch = numbers[4] * kRadians;
  const Eigen::Vector3d forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                                std::sin(pitch));
  // The up vector is perpendicular to `forward`, so that a view straight down has one too.
  const Eigen::Vector3d up(-std::cos(yaw) * std::sin(pitch), -std::sin(yaw) * std::sin(pitch),
                           std::cos(pitch));
  return make_pose(looking(forward, up).transpose(), {numbers[0], numbers[1], numbers[2]});
}

}  // namespace

Eigen::Vector3d PictureView::project(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d p = T_cam_world * point;
  const double px_per_m = perspective ? scale / p.z() : scale;
  return {0.5 * width + px_per_m * p.x(), 0.5 * height + px_per_m * p.y(), p.z()};
}

Eigen::Vector3d PictureView::unproject(double column, double row, double depth_m) const {
  const double m_per_px = perspective ? depth_m / scale : 1.0 / scale;
  const Eigen::Vector3d p(m_per_px * (column - 0.5 * width), m_per_px * (row - 0.5 * height),
                          depth_m);
  return T_cam_world.linear().transpose() * (p - T_cam_world.translation());
}

Eigen::Vector3d PictureView::ray(double column, double row) const {
  const Eigen::Vector3d p = perspective ? Eigen::Vector3d((column - 0.5 * width) / scale,
                                                          (row - 0.5 * height) / scale, 1.0)
                                        : Eigen::Vector3d::UnitZ();
  return T_cam_world.linear().transpose() * p.normalized();
}

PictureView PictureView::enlarged(int factor) const {
  PictureView view = *this;
  view.width *= factor;
  view.height *= factor;
  view.scale *= factor;
  return view;
}

Eigen::AlignedBox3d extent_of(const LabelledMesh& mesh) {
  Eigen::AlignedBox3d box;
  if (mesh.vertices.empty()) return box;
  std::vector<float> values(mesh.vertices.size());
  const auto stray = static_cast<std::ptrdiff_t>(kStray * static_cast<double>(values.size() - 1));
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(mesh.vertices.begin(), mesh.vertices.end(), values.begin(),
                   [&](const Eigen::Vector3f& vertex) { return vertex[axis]; });
    std::nth_element(values.begin(), values.begin() + stray, values.end());
    box.min()[axis] = static_cast<double>(values[static_cast<std::size_t>(stray)]);
    std::nth_element(values.begin(), values.end() - 1 - stray, values.end());
    box.max()[axis] = static_cast<double>(*(values.end() - 1 - stray));
  }
  return box;
}

PictureView parse_view(const std::string& text, const Eigen::AlignedBox3d& extent, int width,
                       int height) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  if (text == "top") return filled(extent, looking(-z, y), width, height);
  if (text == "front") return filled(extent, looking(y, z), width, height);
  if (text == "oblique") {
    const Eigen::Vector3d forward =
        std::cos(kOblique) * (x + y).normalized() - std::sin(kOblique) * z;
    return filled(extent, looking(forward, z), width, height);
  }
  const auto T_world_cam = pose_in(text);
  if (!T_world_cam)
    throw CLI::ValidationError("no view '" + text + "': top, front, oblique or x,y,z,yaw,pitch");
  return {.width = width,
          .height = height,
          .T_cam_world = T_world_cam->inverse(),
          .perspective = true,
          .scale = 0.5 * width / std::tan(0.5 * kFieldOfView)};
}

}  // namespace km
