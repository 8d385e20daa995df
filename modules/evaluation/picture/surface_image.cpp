#include "modules/evaluation/picture/surface_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace km {
namespace {

constexpr double kNear_m = 0.05;  // nearer parts of a perspective view are cut off

using Corners = std::array<Eigen::Vector3d, 3>;

class Rasteriser {
 public:
  Rasteriser(const PictureView& view, const SurfaceCut& cut) : view_(view), cut_(cut) {
    image_.width = view.width;
    image_.height = view.height;
    const auto pixels =
        static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    image_.depth_m.assign(pixels, std::numeric_limits<float>::infinity());
    image_.faces.assign(pixels, SurfaceImage::kNone);
  }

  void draw(const Corners& world, std::uint32_t face) {
    if (world[0].z() > cut_.above_m && world[1].z() > cut_.above_m && world[2].z() > cut_.above_m)
      return;
    if (cut_.back_faces && from_behind(world)) return;
    if (!view_.perspective) {
      draw_projected({view_.project(world[0]), view_.project(world[1]), view_.project(world[2])},
                     face);
      return;
    }
    const std::vector<Eigen::Vector3d> polygon = in_front(world);
    for (std::size_t k = 2; k < polygon.size(); ++k)
      draw_projected(
          {view_.project(polygon[0]), view_.project(polygon[k - 1]), view_.project(polygon[k])},
          face);
  }

  [[nodiscard]] SurfaceImage take() { return std::move(image_); }

 private:
  [[nodiscard]] bool from_behind(const Corners& world) const {
    const Eigen::Vector3d normal = (world[1] - world[0]).cross(world[2] - world[0]);
    const Eigen::Vector3d z_world = view_.T_cam_world.linear().row(2);
    const Eigen::Vector3d towards =
        view_.perspective ? Eigen::Vector3d(world[0] - view_.unproject(0, 0, 0)) : z_world;
    return normal.dot(towards) >= 0.0;
  }

  // The part of a triangle that is beyond the near plane.
  [[nodiscard]] std::vector<Eigen::Vector3d> in_front(const Corners& world) const {
    std::vector<Eigen::Vector3d> polygon;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d& from = world[i];
      const Eigen::Vector3d& to = world[(i + 1) % 3];
      const double d_from = (view_.T_cam_world * from).z() - kNear_m;
      const double d_to = (view_.T_cam_world * to).z() - kNear_m;
      if (d_from >= 0.0) polygon.push_back(from);
      if ((d_from >= 0.0) != (d_to >= 0.0))
        polygon.emplace_back(from + d_from / (d_from - d_to) * (to - from));
    }
    return polygon;
  }

  // Corners as column, row, depth.
  void draw_projected(const Corners& p, std::uint32_t face) {
    const double doubled = area2(p[0], p[1], p[2]);
    if (doubled == 0.0 || !std::isfinite(doubled)) return;
    const auto first = [](double low, int limit) {
      return std::clamp(static_cast<int>(std::ceil(std::max(low, -1.0) - 0.5)), 0, limit);
    };
    const auto last = [](double high, int limit) {
      return std::clamp(static_cast<int>(std::floor(std::min(high, limit + 1.0) - 0.5)), -1,
                        limit - 1);
    };
    const auto [left, right] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [top, bottom] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    for (int row = first(top, view_.height); row <= last(bottom, view_.height); ++row)
      for (int column = first(left, view_.width); column <= last(right, view_.width); ++column) {
        const Eigen::Vector3d pixel(column + 0.5, row + 0.5, 0.0);
        const double a = area2(p[1], p[2], pixel) / doubled;
        const double b = area2(p[2], p[0], pixel) / doubled;
        const double c = 1.0 - a - b;
        if (a < 0.0 || b < 0.0 || c < 0.0) continue;
        // Depth is linear over the picture in a parallel view, its inverse in perspective.
        const double depth_m = view_.perspective
                                   ? 1.0 / (a / p[0].z() + b / p[1].z() + c / p[2].z())
                                   : a * p[0].z() + b * p[1].z() + c * p[2].z();
        put(column, row, depth_m, face);
      }
  }

  static double area2(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                      const Eigen::Vector3d& c) {
    return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  }

  void put(int column, int row, double depth_m, std::uint32_t face) {
    const std::size_t at = image_.at(column, row);
    if (static_cast<float>(depth_m) >= image_.depth_m[at]) return;
    if (std::isfinite(cut_.above_m) &&
        view_.unproject(column + 0.5, row + 0.5, depth_m).z() > cut_.above_m)
      return;
    image_.depth_m[at] = static_cast<float>(depth_m);
    image_.faces[at] = face;
  }

  const PictureView& view_;
  const SurfaceCut& cut_;
  SurfaceImage image_;
};

}  // namespace

SurfaceImage rasterise(const LabelledMesh& mesh, const PictureView& view, const SurfaceCut& cut) {
  Rasteriser rasteriser(view, cut);
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    const auto [a, b, c] = mesh.faces[face];
    rasteriser.draw({mesh.vertices[a].cast<double>(), mesh.vertices[b].cast<double>(),
                     mesh.vertices[c].cast<double>()},
                    static_cast<std::uint32_t>(face));
  }
  return rasteriser.take();
}

}  // namespace km
