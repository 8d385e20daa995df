#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/geometry.hpp"
#include "modules/simulation/rendering/exposure.hpp"
#include "modules/simulation/rendering/pixel_rays.hpp"
#include "modules/simulation/rendering/renderer.hpp"
#include "modules/simulation/rendering/sensor_effects_config.hpp"

namespace km {

/// 8-bit colour image: red, green, blue interleaved, row-major without padding.
struct ColorImage {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  std::vector<std::uint8_t> pixels;
};

/// How one frame was taken.
struct Shot {
  Exposure exposure;
  Vector6 body_velocity = Vector6::Zero();  ///< [rad/s; m/s] in the body frame, at the stamp.
  std::uint64_t noise_seed = 0;             ///< One per image: left and right differ.
};

/// From what the lens throws on the sensor to grey levels: blur of lens and motion, vignetting,
/// exposure, noise, response, quantisation. Immutable; one per camera, shared by threads.
class SensorEffects {
 public:
  /// Throws ConfigError.
  SensorEffects(const PixelRays& rays, const SensorEffectsConfig& config);

  /// What to ask of the renderer for gray() or color(): the radiance or rgb, and the depth if there
  /// is motion blur.
  [[nodiscard]] RenderRequest request(bool color) const;

  /// Throws std::invalid_argument if `view` lacks what request() names or is of another size.
  [[nodiscard]] GrayImage gray(const RenderedView& view, const Shot& shot) const;
  [[nodiscard]] ColorImage color(const RenderedView& view, const Shot& shot) const;

 private:
  static constexpr int kResponseSteps = 1024;

  void require_complete(const RenderedView& view, std::size_t values) const;
  template <typename Value>
  [[nodiscard]] std::vector<Value> on_sensor(const std::vector<Value>& image,
                                             const RenderedView& view, const Shot& shot) const;
  [[nodiscard]] std::uint8_t quantized(float signal) const;
  void expose(const float* linear, std::size_t stride, const Shot& shot, std::mt19937& random,
              std::uint8_t* levels) const;

  SensorEffectsConfig config_;
  PixelRays rays_;
  std::vector<float> relative_light_;  ///< 1 at the centre, less in the corners.
  std::vector<float> noise_tile_;      ///< Unit variance, correlated, square; it repeats.
  std::vector<float> response_;        ///< Grey level over the square root of the signal.
};

}  // namespace km
