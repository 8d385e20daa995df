#include "modules/map_2d/view_rays.hpp"

#include <algorithm>
#include <cmath>

namespace km {
namespace {

// Cells at 3 m must not lie between two columns. Rows need less, because rays of all heights in the
// band free the same cells.
constexpr double kColumns = 80, kRows = 14;

}  // namespace

RayThinner::RayThinner(const Camera& camera, double max_range_m)
    : pixels_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)),
      max_range_m_(max_range_m) {
  const double step_u = std::max(1.0, camera.width / kColumns);
  const double step_v = std::max(1.0, camera.height / kRows);
  for (double v = step_v / 2; v < camera.height; v += step_v)
    for (double u = step_u / 2; u < camera.width; u += step_u) {
      const Eigen::Vector2d pixel(std::floor(u), std::floor(v));
      if (const auto bearing = camera.unproject(pixel))
        bearings_.push_back(
            {static_cast<std::size_t>(pixel.y()) * static_cast<std::size_t>(camera.width) +
                 static_cast<std::size_t>(pixel.x()),
             *bearing});
    }
}

std::optional<ViewRays> RayThinner::add(const DenseFrame& frame) {
  if (frame.depth->millimetres.size() != pixels_ || !frame.T_odom_cam.matrix().allFinite())
    return std::nullopt;
  if (!spacing_.choose(frame.T_odom_cam)) return std::nullopt;
  ViewRays rays{.keyframe = frame.keyframe,
                .origin = frame.T_odom_cam.translation().cast<float>(),
                .ends = {}};
  for (const Bearing& bearing : bearings_) {
    const double depth_m = 1e-3 * frame.depth->millimetres[bearing.pixel];
    if (depth_m <= 0.0) continue;
    const Eigen::Vector3d end =
        std::min(depth_m, max_range_m_) * Eigen::Vector3d(bearing.at.homogeneous());
    rays.ends.emplace_back((frame.T_odom_cam * end).cast<float>());
  }
  return rays;
}

}  // namespace km
