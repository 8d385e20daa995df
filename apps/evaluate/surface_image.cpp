#include "apps/evaluate/surface_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core/utility.hpp>

namespace km {
namespace {

constexpr double kNear_m = 0.05;  // nearer parts of a perspective view are clipped

using Corners = std::array<Eigen::Vector3d, 3>;

class Rasteriser {
 public:
  explicit Rasteriser(const PictureView& view) : view_(view) {
    image_.width = view.width;
    image_.height = view.height;
    const auto pixels =
        static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    image_.depth_m.assign(pixels, std::numeric_limits<float>::infinity());
    image_.faces.assign(pixels, SurfaceImage::kNone);
  }

  void draw(const Corners& world, std::uint32_t face) {
    if (from_behind(world)) return;
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

  // The part of a triangle beyond the near plane.
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
        // In a parallel view the depth is linear over the picture, in perspective its inverse is.
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
    image_.depth_m[at] = static_cast<float>(depth_m);
    image_.faces[at] = face;
  }

  const PictureView& view_;
  SurfaceImage image_;
};

}  // namespace

SurfaceImage rasterise(const LabelledMesh& mesh, const PictureView& view) {
  Rasteriser rasteriser(view);
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    const auto [a, b, c] = mesh.faces[face];
    rasteriser.draw({mesh.vertices[a].cast<double>(), mesh.vertices[b].cast<double>(),
                     mesh.vertices[c].cast<double>()},
                    static_cast<std::uint32_t>(face));
  }
  return rasteriser.take();
}

namespace {

constexpr double kAmbient = 0.62;  // share of ambient light
constexpr double kDirect = 0.48;   // share of light from the upper left
constexpr double kOcclusion = 0.95;
constexpr double kOcclusion_m = 0.8;  // distance within which surface shades a point
constexpr double kLine = 0.45;        // factor on the light at a line
constexpr int kDirections = 8;        // directions of the search around each pixel
constexpr int kRings = 3;
constexpr double kMaxReach_px = 60.0;
constexpr double kMinReach_px = 4.0;
// Jump of depth across one pixel, relative to the plane of the face
constexpr double kJump_px = 6.0;
constexpr double kJump_m = 0.08;

Eigen::Vector3d normal_of(const LabelledMesh& mesh, std::uint32_t face) {
  const auto [a, b, c] = mesh.faces[face];
  const Eigen::Vector3d origin = mesh.vertices[a].cast<double>();
  const Eigen::Vector3d normal =
      (mesh.vertices[b].cast<double>() - origin).cross(mesh.vertices[c].cast<double>() - origin);
  const double length = normal.norm();
  return length > 0.0 ? Eigen::Vector3d(normal / length) : Eigen::Vector3d::UnitZ();
}

// Barycentric coordinates of a point on a face.
Eigen::Vector3d shares_of(const LabelledMesh& mesh, std::uint32_t face,
                          const Eigen::Vector3d& point) {
  const auto [i, j, k] = mesh.faces[face];
  const Eigen::Vector3d a = mesh.vertices[i].cast<double>(), b = mesh.vertices[j].cast<double>(),
                        c = mesh.vertices[k].cast<double>();
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double area2 = normal.squaredNorm();
  if (!(area2 > 0.0)) return {1.0, 0.0, 0.0};
  const double of_b = (point - a).cross(c - a).dot(normal) / area2;
  const double of_c = (b - a).cross(point - a).dot(normal) / area2;
  return {1.0 - of_b - of_c, of_b, of_c};
}

template <typename Use>
void for_each_pixel(const SurfaceImage& surface, const Use& use) {
  cv::parallel_for_(cv::Range(0, surface.height), [&](const cv::Range& rows) {
    for (int row = rows.start; row < rows.end; ++row)
      for (int column = 0; column < surface.width; ++column)
        if (surface.faces[surface.at(column, row)] != SurfaceImage::kNone) use(column, row);
  });
}

class Shader {
 public:
  Shader(const LabelledMesh& mesh, const SurfaceImage& surface, const PictureView& view)
      : mesh_(mesh), surface_(surface), view_(view) {
    points_.resize(surface.faces.size());
    for_each_pixel(surface, [&](int column, int row) {
      const std::size_t at = surface.at(column, row);
      points_[at] =
          view.unproject(column + 0.5, row + 0.5, static_cast<double>(surface.depth_m[at]))
              .cast<float>();
    });
    const Eigen::Vector3d from(-0.45, -0.6, -0.66);  // direction to the light in the camera frame:
                                                     // left, above, in front
    light_ = view.T_cam_world.linear().transpose() * from.normalized();
    for (int ring = 1; ring <= kRings; ++ring)
      for (int i = 0; i < kDirections; ++i) {
        // Rings are rotated against each other, so that no direction is searched twice.
        const double angle =
            2.0 * std::numbers::pi * (i + ring / static_cast<double>(kRings)) / kDirections;
        const double radius = static_cast<double>(ring) / kRings;
        around_.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
      }
  }

  // Light on a pixel that shows a face, 0 to about 1.
  [[nodiscard]] double light(int column, int row) const {
    const Eigen::Vector3d normal = facing(column, row);
    const double direct = std::max(0.0, normal.dot(light_));
    const double open = 1.0 - kOcclusion * occlusion(column, row, normal);
    const double line = on_line(column, row, normal) ? kLine : 1.0;
    return line * (kAmbient * open + kDirect * direct * (0.5 + 0.5 * open));
  }

 private:
  [[nodiscard]] bool shown(int column, int row) const {
    return column >= 0 && row >= 0 && column < surface_.width && row < surface_.height &&
           surface_.faces[surface_.at(column, row)] != SurfaceImage::kNone;
  }

  [[nodiscard]] Eigen::Vector3d point(int column, int row) const {
    return points_[surface_.at(column, row)].cast<double>();
  }

  // The face's normal on the viewer's side.
  [[nodiscard]] Eigen::Vector3d facing(int column, int row) const {
    const Eigen::Vector3d normal = normal_of(mesh_, surface_.faces[surface_.at(column, row)]);
    return normal.dot(view_.ray(column + 0.5, row + 0.5)) > 0.0 ? Eigen::Vector3d(-normal) : normal;
  }

  [[nodiscard]] double metres_per_px(int column, int row) const {
    if (!view_.perspective) return 1.0 / view_.scale;
    return static_cast<double>(surface_.depth_m[surface_.at(column, row)]) / view_.scale;
  }

  // Share of the surroundings above the face's plane, 0 to 1: the mean, over the searched points,
  // of the sine of their elevation, decreasing with distance.
  [[nodiscard]] double occlusion(int column, int row, const Eigen::Vector3d& normal) const {
    const Eigen::Vector3d here = point(column, row);
    const double reach_px =
        std::clamp(kOcclusion_m / metres_per_px(column, row), kMinReach_px, kMaxReach_px);
    const double reach_m = std::max(kOcclusion_m, reach_px * metres_per_px(column, row));
    double sum = 0.0;
    for (const Eigen::Vector2d& offset : around_) {
      const int x = column + static_cast<int>(std::lround(reach_px * offset.x()));
      const int y = row + static_cast<int>(std::lround(reach_px * offset.y()));
      if (!shown(x, y)) continue;
      const Eigen::Vector3d away = point(x, y) - here;
      const double distance = away.norm();
      if (distance <= 0.0) continue;
      const double sine = away.dot(normal) / distance;
      const double nearness = 1.0 / (1.0 + distance * distance / (4.0 * reach_m * reach_m));
      sum += nearness * std::max(0.0, sine - 0.1);
    }
    return std::min(1.0, sum / static_cast<double>(around_.size()));
  }

  // Whether the neighbouring surface is off the plane of the face, or there is none.
  [[nodiscard]] bool on_line(int column, int row, const Eigen::Vector3d& normal) const {
    const Eigen::Vector3d here = point(column, row);
    const double limit_m = std::max(kJump_m, kJump_px * metres_per_px(column, row));
    constexpr std::array<std::array<int, 2>, 4> kNeighbours = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
    return std::any_of(kNeighbours.begin(), kNeighbours.end(), [&](const auto& step) {
      const int x = column + step[0];
      const int y = row + step[1];
      if (x < 0 || y < 0 || x >= surface_.width || y >= surface_.height) return false;
      if (!shown(x, y)) return true;
      // The farther side of a jump gets the line.
      if (surface_.depth_m[surface_.at(x, y)] > surface_.depth_m[surface_.at(column, row)])
        return false;
      return std::abs((point(x, y) - here).dot(normal)) > limit_m;
    });
  }

  const LabelledMesh& mesh_;
  const SurfaceImage& surface_;
  const PictureView& view_;
  Eigen::Vector3d light_;
  std::vector<Eigen::Vector3f> points_;  // points in the world, of pixels that show a face
  std::vector<Eigen::Vector2d> around_;  // at most one long
};

}  // namespace

cv::Mat3b paint(const LabelledMesh& mesh, const SurfaceImage& surface, const PictureView& view,
                const std::vector<LabelledMesh::Color>& vertex_colors, bool blend) {
  cv::Mat3b picture(surface.height, surface.width, cv::Vec3b(255, 255, 255));
  for_each_pixel(surface, [&](int column, int row) {
    const std::size_t at = surface.at(column, row);
    const std::uint32_t face = surface.faces[at];
    const Eigen::Vector3d point =
        view.unproject(column + 0.5, row + 0.5, static_cast<double>(surface.depth_m[at]));
    Eigen::Vector3d shares = shares_of(mesh, face, point).cwiseMax(0.0);
    if (!blend) {
      Eigen::Index most = 0;
      shares.maxCoeff(&most);
      shares = Eigen::Vector3d::Unit(most);
    }
    Eigen::Vector3d rgb = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const auto& color = vertex_colors[mesh.faces[face][static_cast<std::size_t>(k)]];
      rgb += shares[k] / shares.sum() * Eigen::Vector3d(color[0], color[1], color[2]);
    }
    picture(row, column) =
        cv::Vec3b(cv::saturate_cast<std::uint8_t>(rgb[2]), cv::saturate_cast<std::uint8_t>(rgb[1]),
                  cv::saturate_cast<std::uint8_t>(rgb[0]));
  });
  return picture;
}

void shade(cv::Mat3b& picture, const LabelledMesh& mesh, const SurfaceImage& surface,
           const PictureView& view) {
  const Shader shader(mesh, surface, view);
  for_each_pixel(surface, [&](int column, int row) {
    cv::Vec3b& pixel = picture(row, column);
    const double light = shader.light(column, row);
    for (int channel = 0; channel < 3; ++channel)
      pixel[channel] = cv::saturate_cast<std::uint8_t>(light * pixel[channel]);
  });
}

}  // namespace km
