#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "apps/simulate/robot_scenario.hpp"
#include "modules/simulation/dataset/recording_layout.hpp"
#include "modules/simulation/motion/depth_sensor.hpp"
#include "modules/simulation/rendering/exposure.hpp"
#include "modules/simulation/rendering/renderer.hpp"
#include "modules/simulation/rendering/sensor_effects.hpp"

namespace km {

/// The cameras of one robot: takes and stores its images, frame by frame, in any order and from
/// several threads; a frame's bytes depend on nothing but the scenario.
class RobotCameras {
 public:
  /// `scenario` and `renderer` outlive this.
  RobotCameras(const RobotScenario& scenario, const SimulationOptions& options,
               const Renderer& renderer);

  [[nodiscard]] const RecordingLayout& layout() const { return layout_; }
  [[nodiscard]] std::size_t frame_count() const { return scenario_.images.size(); }

  /// What frame `i` consists of.
  [[nodiscard]] std::vector<ImageChannel> channels(std::size_t i) const;
  /// Stamps of the frames that have this channel; empty if the recording has none.
  [[nodiscard]] std::vector<Stamp> stamps(ImageChannel channel) const;

  /// Light that frame `i` gets, for its exposure; cheap.
  [[nodiscard]] RenderedView meter(std::size_t i) const;
  /// The exposure of every frame, in order; before the first record().
  void set_exposures(std::vector<Exposure> exposures) { exposures_ = std::move(exposures); }

  /// Renders frame `i` and writes the images that are missing. Throws RecordingError.
  void record(std::size_t i) const;

 private:
  [[nodiscard]] Shot shot(std::size_t i, ImageChannel channel) const;
  [[nodiscard]] std::vector<std::uint8_t> encoded(ImageChannel channel, std::size_t i,
                                                  const RenderedView& left) const;

  const RobotScenario& scenario_;
  const Renderer& renderer_;
  CameraKind cameras_;
  ImageFormat format_;
  bool labels_;
  bool color_;
  std::size_t depth_step_ = 0;  // frames from one depth image to the next, 0: none
  RecordingLayout layout_;
  PixelRays left_;
  PixelRays right_;
  PixelRays meter_;
  SensorEffects left_effects_;
  SensorEffects right_effects_;
  DepthSensor depth_sensor_;
  std::vector<Exposure> exposures_;
};

/// Settings of the cameras' sensors.
[[nodiscard]] SensorEffectsConfig sensor_effects(const SimulationOptions& options);

}  // namespace km
