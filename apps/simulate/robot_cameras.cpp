#include "apps/simulate/robot_cameras.hpp"

#include <algorithm>
#include <cmath>

#include "modules/simulation/dataset/image_encoding.hpp"
#include "modules/simulation/dataset/whole_file.hpp"
#include "modules/simulation/motion/default_rig.hpp"

namespace km {
namespace {

DepthSensorOptions depth_sensor(const SensorRig& rig, bool ideal) {
  DepthSensorOptions options = depth_options(rig);
  options.ideal = ideal;
  return options;
}

std::size_t depth_step(const SimulationOptions& options) {
  if (!options.depth) return 0;
  return static_cast<std::size_t>(std::lround(options.rate_hz / options.depth_rate_hz));
}

bool contains(const std::vector<ImageChannel>& channels, ImageChannel channel) {
  return std::find(channels.begin(), channels.end(), channel) != channels.end();
}

RenderRequest merged(const RenderRequest& a, const RenderRequest& b) {
  return {a.radiance || b.radiance, a.rgb || b.rgb, a.depth || b.depth, a.labels || b.labels};
}

}  // namespace

SensorEffectsConfig sensor_effects(const SimulationOptions& options) {
  SensorEffectsConfig config;
  config.motion_blur = options.motion_blur;
  return config;
}

RobotCameras::RobotCameras(const RobotScenario& scenario, const SimulationOptions& options,
                           const Renderer& renderer)
    : scenario_(scenario),
      renderer_(renderer),
      cameras_(options.cameras),
      format_(options.format),
      labels_(options.labels),
      color_(options.color),
      depth_step_(depth_step(options)),
      layout_(options.output / scenario.name, options.format),
      left_(scenario.rig.stereo.cameras[0]),
      right_(scenario.rig.stereo.cameras[1]),
      meter_(shrunk(scenario.rig.stereo.cameras[0], ExposureControl::kMeterShrink)),
      left_effects_(left_, sensor_effects(options)),
      right_effects_(right_, sensor_effects(options)),
      depth_sensor_(depth_sensor(scenario.rig, options.ideal_depth)) {}

std::vector<ImageChannel> RobotCameras::channels(std::size_t i) const {
  std::vector<ImageChannel> channels = {ImageChannel::kLeft};
  if (cameras_ == CameraKind::kStereo) channels.push_back(ImageChannel::kRight);
  if (depth_step_ > 0 && i % depth_step_ == 0) channels.push_back(ImageChannel::kDepth);
  if (labels_) channels.push_back(ImageChannel::kLabels);
  if (color_) channels.push_back(ImageChannel::kColor);
  return channels;
}

std::vector<Stamp> RobotCameras::stamps(ImageChannel channel) const {
  std::vector<Stamp> stamps;
  for (std::size_t i = 0; i < frame_count(); ++i)
    if (contains(channels(i), channel)) stamps.push_back(scenario_.images[i]);
  return stamps;
}

RenderedView RobotCameras::meter(std::size_t i) const {
  return renderer_.render(meter_, scenario_.motion(scenario_.images[i]).T_world_body, {});
}

void RobotCameras::record(std::size_t i) const {
  const Stamp stamp = scenario_.images[i];
  std::vector<ImageChannel> missing = channels(i);
  std::erase_if(
      missing, [&](ImageChannel channel) { return is_whole_image(layout_.image(channel, stamp)); });
  if (missing.empty()) return;

  const SE3 T_world_body = scenario_.motion(stamp).T_world_body;
  RenderRequest request = {false, false, false, false};
  if (contains(missing, ImageChannel::kLeft)) request = left_effects_.request(false);
  if (contains(missing, ImageChannel::kColor))
    request = merged(request, left_effects_.request(true));
  request.depth |= contains(missing, ImageChannel::kDepth);
  request.labels |= contains(missing, ImageChannel::kLabels);
  const RenderedView left = renderer_.render(left_, T_world_body, request);
  for (const ImageChannel channel : missing)
    write_whole_file(layout_.image(channel, stamp), encoded(channel, i, left));
}

Shot RobotCameras::shot(std::size_t i, ImageChannel channel) const {
  const BodyMotion motion = scenario_.motion(scenario_.images[i]);
  Shot shot;
  shot.exposure = exposures_.at(i);
  shot.body_velocity << motion.angular_velocity_body,
      motion.T_world_body.linear().transpose() * motion.velocity_world;
  const std::uint64_t camera =
      derived_seed(scenario_.seed, 16 + static_cast<std::uint64_t>(channel));
  shot.noise_seed = derived_seed(camera, static_cast<std::uint64_t>(scenario_.images[i]));
  return shot;
}

std::vector<std::uint8_t> RobotCameras::encoded(ImageChannel channel, std::size_t i,
                                                const RenderedView& left) const {
  const Shot taken = shot(i, channel);
  switch (channel) {
    case ImageChannel::kLeft:
      return encode_gray(left_effects_.gray(left, taken), format_);
    case ImageChannel::kRight: {
      const SE3 T_world_body = scenario_.motion(scenario_.images[i]).T_world_body;
      const RenderedView right =
          renderer_.render(right_, T_world_body, right_effects_.request(false));
      return encode_gray(right_effects_.gray(right, taken), format_);
    }
    case ImageChannel::kDepth:
      return encode_depth(
          left.width, left.height,
          depth_sensor_.measure(left.depth_m, left.width, left.height, taken.noise_seed));
    case ImageChannel::kLabels:
      return encode_labels(left.width, left.height, left.labels);
    case ImageChannel::kColor:
      break;
  }
  const ColorImage color = left_effects_.color(left, taken);
  return encode_color(color.width, color.height, color.pixels, format_);
}

}  // namespace km
