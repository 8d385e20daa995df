#include "modules/core/camera/depth_lookup.hpp"

#include <algorithm>
#include <cmath>

namespace km {
namespace {

constexpr double kMillimetresPerMetre = 1e3;
constexpr double kEdge_px = 1.5;

bool has_size(int width, int height, std::size_t pixels, const Camera& camera) {
  return width == camera.width && height == camera.height &&
         pixels == static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

}  // namespace

std::optional<double> inverse_depth_at(const DepthImage& image, const Eigen::Vector2d& px,
                                       double max_spread) {
  // The condition is also false for NaN.
  if (!(px.x() >= 0.0 && px.y() >= 0.0 && px.x() <= image.width - 1 && px.y() <= image.height - 1))
    return std::nullopt;
  const auto depth_mm = [&image](int x, int y) {
    return image.millimetres[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                             static_cast<std::size_t>(x)];
  };
  if (depth_mm(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y()))) == 0)
    return std::nullopt;
  const int x0 = static_cast<int>(px.x());
  const int y0 = static_cast<int>(px.y());
  double sum = 0.0, weights = 0.0, least = 1e9, most = 0.0;
  for (int y = y0; y <= std::min(y0 + 1, image.height - 1); ++y)
    for (int x = x0; x <= std::min(x0 + 1, image.width - 1); ++x) {
      const double weight = (1.0 - std::abs(px.x() - x)) * (1.0 - std::abs(px.y() - y));
      if (weight == 0.0 || depth_mm(x, y) == 0) continue;
      const double inverse_depth = kMillimetresPerMetre / depth_mm(x, y);
      sum += weight * inverse_depth;
      weights += weight;
      least = std::min(least, inverse_depth);
      most = std::max(most, inverse_depth);
    }
  if (most - least > max_spread) return std::nullopt;
  return sum / weights;
}

double depth_edge_threshold(const StereoRig& rig) {
  return kEdge_px / (rig.cameras[0].fx * rig.baseline_m());
}

bool fits(const GrayImage& image, const Camera& camera) {
  return has_size(image.width, image.height, image.pixels.size(), camera);
}

bool fits(const DepthImage& image, const Camera& camera) {
  return has_size(image.width, image.height, image.millimetres.size(), camera);
}

bool fits(const StereoFrame& frame, const StereoRig& rig) {
  if (!fits(frame.left, rig.cameras[0])) return false;
  if (rig.depth_source == DepthSource::kRightImage) return fits(frame.right, rig.cameras[1]);
  return frame.depth == nullptr || fits(*frame.depth, rig.cameras[0]);
}

}  // namespace km
