#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/rendering/lens_clutter.hpp"
#include "apps/lab/simulation/rendering/renderer.hpp"
#include "apps/lab/simulation/rendering/sensor_effects_config.hpp"
#include "apps/lab/simulation/rendering/shot.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Auto-exposure as in recorded cameras: it controls the mean grey level, with a delay.
///
/// Frames may be developed in any order and on any thread. A fast sequential pass beforehand gives
/// the exposure of every frame, from views of the left camera shrunk() by kMeterShrink:
///
///     const PixelRays meter(shrunk(left, ExposureControl::kMeterShrink));
///     ExposureControl control(config, rate_hz);
///     for (each frame) exposures.push_back(control.next(renderer.render(meter, T_world_body,
///     {})));
///
/// Deterministic: a resumed run repeats the pass and gets the same numbers.
class ExposureControl {
 public:
  static constexpr int kMeterShrink = 8;

  /// `rate_hz`: rate of the frames. Throws ConfigError.
  ExposureControl(const SensorEffectsConfig& config, double rate_hz);

  /// Returns the exposure of the frame that sees `scene`, from its `radiance` times `light`. The
  /// first frame gets the target level at once.
  [[nodiscard]] Exposure next(const RenderedView& scene, double light = 1.0);

 private:
  SensorEffectsConfig config_;
  double share_per_frame_ = 1.0;
  double log_gain_ = 0.0;
  bool started_ = false;
};

/// Passages of a robot through dark and bright places: a factor of all light over time. Each
/// passage is dark or bright by chance. Its light comes and goes within kRamp_s, evenly in its
/// logarithm. Immutable.
class LightPassages {
 public:
  static constexpr double kRamp_s = 0.4;

  /// Passages within `duration_s`. Throws ConfigError.
  LightPassages(const SensorEffectsConfig& config, double duration_s, std::uint64_t seed);

  /// Factor at `t_s`; 1 outside all passages.
  [[nodiscard]] double factor(double t_s) const;

 private:
  struct Passage {
    double begin_s = 0.0, end_s = 0.0;
    double log_light = 0.0;
  };
  std::vector<Passage> passages_;  // ascending, without overlap
};

/// Time of row `row` of `height` rows after the frame's stamp [s], which is the middle of the
/// image.
[[nodiscard]] inline double row_delay_s(const SensorEffectsConfig& config, int row, int height) {
  return config.rolling_shutter_s * ((row + 0.5) / height - 0.5);
}

/// Blur of a sharp image by the lens: a Gaussian. Border values continue outwards. Row-major,
/// width * height.
[[nodiscard]] std::vector<float> lens_blurred(const std::vector<float>& image, int width,
                                              int height);

/// Motion of each pixel's content in the image while the shutter is open [px].
///
/// The camera rotates and moves with the body. A static point at depth z has bearing b = (x, y, 1).
/// On the plane z = 1 its image motion is -(omega x b + v / z) less its part along b. The camera's
/// own bearings convert it to pixels, distortion included. `depth_m`: 0 is infinitely far.
/// `body_velocity` = [rad/s; m/s] in the body frame.
[[nodiscard]] std::vector<Eigen::Vector2f> image_motion(const PixelRays& rays,
                                                        const std::vector<float>& depth_m,
                                                        const Vector6& body_velocity,
                                                        double time_s);

/// Mean of `image` along each pixel's motion, centred on the pixel.
[[nodiscard]] std::vector<float> blurred(const std::vector<float>& image, int width, int height,
                                         const std::vector<Eigen::Vector2f>& motion);

/// Converts light on the sensor to grey levels: blur of lens and motion, rain, glare and dirt,
/// vignetting, exposure, noise, response, quantisation. Immutable; one per camera, shared by
/// threads.
class SensorEffects {
 public:
  /// `dirt_seed`: seed of the spots on this lens. Throws ConfigError.
  SensorEffects(const PixelRays& rays, const SensorEffectsConfig& config,
                std::uint64_t dirt_seed = 0);

  /// Request to the renderer for gray(): the radiance, and the depth if there is motion blur.
  [[nodiscard]] RenderRequest request() const;

  /// Precondition: `view` has what request() names.
  [[nodiscard]] GrayImage gray(const RenderedView& view, const Shot& shot) const;

 private:
  static constexpr int kResponseSteps = 1024;

  [[nodiscard]] std::vector<float> on_sensor(const RenderedView& view, const Shot& shot) const;
  [[nodiscard]] std::uint8_t quantized(float signal) const;

  SensorEffectsConfig config_;
  PixelRays rays_;
  LensClutter clutter_;
  std::vector<float> relative_light_;  ///< 1 at the centre, less in the corners.
  std::vector<float> noise_tile_;      ///< Unit variance, correlated, square; it repeats.
  std::vector<float> response_;        ///< Grey level by the square root of the signal.
};

}  // namespace km
