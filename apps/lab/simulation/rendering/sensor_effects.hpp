#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include "apps/lab/simulation/rendering/renderer.hpp"
#include "modules/core/config.hpp"
#include "modules/core/frame.hpp"
#include "modules/core/geometry.hpp"

namespace km {

/// Effects of a lens and a sensor on light; visit_fields() describes the fields, which are the keys
/// below `sensor:`.
struct SensorEffectsConfig {
  static constexpr const char* kSection = "sensor";

  double vignetting = 0.2;
  double lens_blur_px = 0.6;  ///< With this value the Vicon room has the same variance of the
                              ///< Laplacian as recorded images.
  double read_noise = 1.0;
  double photon_noise = 2.0;
  double noise_correlation_px = 1.2;  ///< Demosaicing, filters and JPEG leave little fine noise.
  double gamma = 1.0;
  double target_level = 0.55;
  double adaptation = 0.02;
  double unit_exposure_s = 0.005;
  double max_exposure_s = 0.015;
  bool motion_blur = true;

  void visit_fields(auto& visitor) {
    visitor.field("vignetting", vignetting, {0.0, 0.9},
                  "share of light lost in the corners; it falls as the fourth power of a cosine");
    visitor.field("lens_blur_px", lens_blur_px, {0.0, 5.0}, "px, standard deviation of a point");
    visitor.field("read_noise", read_noise, {0.0, 50.0}, "grey levels, in the dark");
    visitor.field("photon_noise", photon_noise, {0.0, 50.0},
                  "grey levels just below saturation; it falls with the square root of the light");
    visitor.field("noise_correlation_px", noise_correlation_px, {0.0, 4.0}, "px; 0: white noise");
    visitor.field("gamma", gamma, {1.0, 3.0}, "grey = signal^(1 / gamma); 1: linear");
    visitor.field("target_level", target_level, {0.05, 0.95}, "mean grey, share of saturation");
    visitor.field("adaptation", adaptation, {0.001, 1.0},
                  "share of the way to the target, in log exposure, per frame at 20 Hz");
    visitor.field("unit_exposure_s", unit_exposure_s, {1e-5, 1.0},
                  "s, shutter time at which a white wall in the sun saturates");
    visitor.field("max_exposure_s", max_exposure_s, {1e-5, 1.0},
                  "s; darker scenes are amplified instead, noise included");
    visitor.field("motion_blur", motion_blur, "smear along the motion while the shutter is open");
  }
};

/// Setting of the sensor for one frame.
struct Exposure {
  double gain = 1.0;    ///< Radiance 1 / gain saturates the sensor.
  double time_s = 0.0;  ///< Shutter time, centred on the frame's stamp.
};

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

  /// `rate_hz`: rate of the frames. Throws ConfigError, and std::invalid_argument if the rate is
  /// not positive.
  ExposureControl(const SensorEffectsConfig& config, double rate_hz);

  /// Returns the exposure of the frame that sees `scene`, from its `radiance`. The first frame gets
  /// the target level at once. Throws std::invalid_argument without radiance.
  [[nodiscard]] Exposure next(const RenderedView& scene);

 private:
  SensorEffectsConfig config_;
  double share_per_frame_ = 1.0;
  double log_gain_ = 0.0;
  bool started_ = false;
};

/// Blur of a sharp image by the lens: a Gaussian of `sigma_px`. Border values continue outwards.
/// Row-major, width * height. Value: float, Eigen::Vector3f.
template <typename Value>
[[nodiscard]] std::vector<Value> lens_blurred(const std::vector<Value>& image, int width,
                                              int height, double sigma_px);

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

/// Mean of `image` along each pixel's motion, centred on the pixel. Value: float, Eigen::Vector3f.
template <typename Value>
[[nodiscard]] std::vector<Value> blurred(const std::vector<Value>& image, int width, int height,
                                         const std::vector<Eigen::Vector2f>& motion);

/// 8-bit colour image: red, green, blue interleaved, row-major without padding.
struct ColorImage {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  std::vector<std::uint8_t> pixels;
};

/// Conditions under which one frame was taken.
struct Shot {
  Exposure exposure;
  Vector6 body_velocity = Vector6::Zero();  ///< [rad/s; m/s] in the body frame, at the stamp.
  std::uint64_t noise_seed = 0;             ///< Seed of the image; different for left and right
                                            ///< images.
};

/// Converts light on the sensor to grey levels: blur of lens and motion, vignetting, exposure,
/// noise, response, quantisation. Immutable; one per camera, shared by threads.
class SensorEffects {
 public:
  /// Throws ConfigError.
  SensorEffects(const PixelRays& rays, const SensorEffectsConfig& config);

  /// Request to the renderer for gray() or color(): the radiance or rgb, and the depth if there is
  /// motion blur.
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
