#include "modules/simulation/rendering/pixel_rays.hpp"

#include <stdexcept>
#include <string>

namespace km {
namespace {

void require_usable(const PinholeCamera& camera) {
  if (camera.width < 1 || camera.height < 1)
    throw std::invalid_argument("camera: an image of " + std::to_string(camera.width) + " x " +
                                std::to_string(camera.height) + " pixels");
  if (!(camera.fx > 0.0 && camera.fy > 0.0))
    throw std::invalid_argument("camera: focal lengths " + std::to_string(camera.fx) + ", " +
                                std::to_string(camera.fy) + " are not both positive");
}

}  // namespace

PixelRays::PixelRays(const PinholeCamera& camera) : camera_(camera) {
  require_usable(camera);
  bearings_.reserve(static_cast<std::size_t>(camera.width + 1) *
                    static_cast<std::size_t>(camera.height + 1));
  for (int y = 0; y <= camera.height; ++y) {
    for (int x = 0; x <= camera.width; ++x) {
      const Eigen::Vector2d pixel(x, y);
      const Eigen::Vector2d pinhole((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
      bearings_.push_back(camera.unproject(pixel).value_or(pinhole).cast<float>());
    }
  }
}

PinholeCamera shrunk(const PinholeCamera& camera, int factor) {
  if (factor < 1)
    throw std::invalid_argument("shrunk: a factor of " + std::to_string(factor) + " is below 1");
  PinholeCamera small = camera;
  small.width = (camera.width + factor - 1) / factor;
  small.height = (camera.height + factor - 1) / factor;
  small.fx /= factor;
  small.fy /= factor;
  // The corner of the image, half a pixel before the first centre, stays where it is.
  small.cx = (camera.cx + 0.5) / factor - 0.5;
  small.cy = (camera.cy + 0.5) / factor - 0.5;
  return small;
}

}  // namespace km
