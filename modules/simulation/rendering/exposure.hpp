#pragma once

#include "modules/simulation/rendering/renderer.hpp"
#include "modules/simulation/rendering/sensor_effects_config.hpp"

namespace km {

/// Setting of the sensor for one frame.
struct Exposure {
  double gain = 1.0;    ///< Radiance that saturates is 1 / gain.
  double time_s = 0.0;  ///< Shutter time, centred on the frame's stamp.
};

/// Auto-exposure as recorded cameras have it: it steers the mean grey level to a target, and lags.
///
/// Frames may be developed in any order and on any thread: a cheap sequential pass beforehand gives
/// the exposure of every frame, from views of the left camera shrunk() by kMeterShrink:
///
///     const PixelRays meter(shrunk(left, ExposureControl::kMeterShrink));
///     ExposureControl control(config, rate_hz);
///     for (each frame) exposures.push_back(control.next(renderer.render(meter, T_world_body,
///     {})));
///
/// Deterministic; a resumed run repeats the pass and gets the same numbers.
class ExposureControl {
 public:
  static constexpr int kMeterShrink = 8;

  /// `rate_hz` of the frames. Throws ConfigError, std::invalid_argument for a rate not positive.
  ExposureControl(const SensorEffectsConfig& config, double rate_hz);

  /// Exposure of the frame that sees `scene` (its `radiance` is used). The first frame is exposed
  /// to its target at once. Throws std::invalid_argument without radiance.
  [[nodiscard]] Exposure next(const RenderedView& scene);

 private:
  SensorEffectsConfig config_;
  double share_per_frame_ = 1.0;
  double log_gain_ = 0.0;
  bool started_ = false;
};

}  // namespace km
