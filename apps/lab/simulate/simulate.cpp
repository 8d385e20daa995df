#include "apps/lab/simulate/simulate.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "apps/lab/simulate/robot_scenario.hpp"
#include "apps/lab/simulation/dataset/recording.hpp"
#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/depth_sensor.hpp"
#include "apps/lab/simulation/motion/traffic.hpp"
#include "apps/lab/simulation/rendering/renderer.hpp"
#include "apps/lab/simulation/rendering/sensor_effects.hpp"
#include "apps/lab/simulation/rendering/surfaces.hpp"
#include "apps/program_version.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Parts of a robot's seed; robot_scenario.cpp has those below 16, channels have 16 to 20.
constexpr std::uint64_t kLeftDirt = 32, kRightDirt = 33, kPassages = 34, kRain = 35;
constexpr std::uint64_t kTraffic = 1000;  // part of the run's seed; robots have those below

World make_world(const SimulationOptions& options) {
  switch (options.world) {
    case WorldKind::kCity:
      return make_city(options.seed);
    case WorldKind::kCamp:
      return make_camp(options.seed);
    case WorldKind::kViconRoom:
      break;
  }
  return make_vicon_room(options.seed);
}

DepthSensorOptions depth_sensor(const SensorRig& rig) {
  return {.focal_px = rig.stereo.cameras[0].fx, .baseline_m = rig.stereo.baseline_m()};
}

std::size_t depth_step(const SimulationOptions& options) {
  if (!options.depth) return 0;
  return static_cast<std::size_t>(std::lround(options.rate_hz / options.depth_rate_hz));
}

bool contains(const std::vector<ImageChannel>& channels, ImageChannel channel) {
  return std::ranges::find(channels, channel) != channels.end();
}

// Calls body(0) to body(count - 1) from several threads. Rethrows the first exception.
void run_parallel(int threads, std::size_t count, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr error;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) body(i);
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!error) error = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int i = 0; i < threads; ++i) workers.emplace_back(work);
  }
  if (error) std::rethrow_exception(error);
}

// The cameras of one robot: renders and stores its images, frame by frame, in any order and from
// several threads. The bytes of a frame depend only on the scenario.
class RobotCameras {
 public:
  // All arguments outlive this.
  RobotCameras(const RobotScenario& scenario, const SimulationOptions& options,
               const Renderer& renderer, const Traffic& traffic)
      : scenario_(scenario),
        renderer_(renderer),
        traffic_(traffic),
        options_(options),
        depth_step_(depth_step(options)),
        layout_(options.output / scenario.name),
        left_(scenario.rig.stereo.cameras[0]),
        right_(scenario.rig.stereo.cameras[1]),
        meter_(shrunk(scenario.rig.stereo.cameras[0], ExposureControl::kMeterShrink)),
        left_effects_(left_, options.effects.sensor, derived_seed(scenario.seed, kLeftDirt)),
        right_effects_(right_, options.effects.sensor, derived_seed(scenario.seed, kRightDirt)),
        passages_(options.effects.sensor, scenario.duration_s(),
                  derived_seed(scenario.seed, kPassages)) {}

  [[nodiscard]] const RecordingLayout& layout() const { return layout_; }
  [[nodiscard]] std::size_t frame_count() const { return scenario_.images.size(); }

  // Channels of frame `i`.
  [[nodiscard]] std::vector<ImageChannel> channels(std::size_t i) const {
    std::vector<ImageChannel> channels = {ImageChannel::kLeft};
    if (options_.cameras == CameraKind::kStereo) channels.push_back(ImageChannel::kRight);
    if (depth_step_ > 0 && i % depth_step_ == 0) channels.push_back(ImageChannel::kDepth);
    if (options_.labels) channels.push_back(ImageChannel::kLabels);
    return channels;
  }

  // Stamps of the frames that have this channel; empty if the recording has none.
  [[nodiscard]] std::vector<Stamp> stamps(ImageChannel channel) const {
    std::vector<Stamp> stamps;
    for (std::size_t i = 0; i < frame_count(); ++i)
      if (contains(channels(i), channel)) stamps.push_back(scenario_.image_stamps[i]);
    return stamps;
  }

  // Small view of frame `i` for its exposure; fast.
  [[nodiscard]] RenderedView meter(std::size_t i) const {
    return renderer_.render(meter_, scenario_.motion(scenario_.images[i]).T_world_body, {});
  }

  // Factor of the light at frame `i`.
  [[nodiscard]] double light(std::size_t i) const {
    return passages_.factor(seconds_between(scenario_.images.front(), scenario_.images[i]));
  }

  // Sets the exposure of every frame, in order; call before the first record().
  void set_exposures(std::vector<Exposure> exposures) { exposures_ = std::move(exposures); }

  // Renders frame `i` and writes the images that are missing. Throws std::system_error.
  void record(std::size_t i) const {
    const Stamp stamp = scenario_.image_stamps[i];
    std::vector<ImageChannel> missing = channels(i);
    std::erase_if(missing, [&](ImageChannel channel) {
      return is_whole_image(layout_.image(channel, stamp));
    });
    if (missing.empty()) return;

    const std::unique_ptr<const MovedSurfaces> moved = moved_surfaces(i);
    RenderRequest request = {false, false, false};
    if (contains(missing, ImageChannel::kLeft)) request = left_effects_.request();
    request.depth |= contains(missing, ImageChannel::kDepth);
    request.labels |= contains(missing, ImageChannel::kLabels);
    const RenderedView left =
        renderer_.render(left_, row_poses(i, left_.camera().height), request, moved.get());
    for (const ImageChannel channel : missing)
      write_whole_file(layout_.image(channel, stamp), encoded(channel, i, left, moved.get()));
  }

 private:
  [[nodiscard]] Shot shot(std::size_t i, ImageChannel channel) const {
    const BodyMotion motion = scenario_.motion(scenario_.images[i]);
    Shot shot{.exposure = exposures_.at(i), .lights = {}};
    shot.body_velocity << motion.angular_velocity_body,
        motion.T_world_body.linear().transpose() * motion.velocity_world;
    const std::uint64_t camera =
        derived_seed(scenario_.seed, 16 + static_cast<std::uint64_t>(channel));
    const auto stamp = static_cast<std::uint64_t>(scenario_.images[i]);
    shot.noise_seed = derived_seed(camera, stamp);
    shot.light = light(i);
    if (options_.effects.sensor.glare > 0.0)
      shot.lights = renderer_.visible_lights(motion.T_world_body);
    shot.down_body = -motion.T_world_body.linear().row(2).transpose();
    shot.rain_seed = derived_seed(derived_seed(scenario_.seed, kRain), stamp);
    return shot;
  }

  // Surfaces that move, at frame `i`; null if there are none.
  [[nodiscard]] std::unique_ptr<const MovedSurfaces> moved_surfaces(std::size_t i) const {
    if (traffic_.ways.empty()) return nullptr;
    const double t_s = seconds_between(scenario_.images.front(), scenario_.images[i]);
    return std::make_unique<const MovedSurfaces>(traffic_.shapes, traffic_.poses(t_s));
  }

  // Pose of the body for each row of frame `i`; a single one if all rows are seen at once.
  [[nodiscard]] std::vector<SE3> row_poses(std::size_t i, int height) const {
    const Stamp stamp = scenario_.images[i];
    const SensorEffectsConfig& config = options_.effects.sensor;
    if (config.rolling_shutter_s == 0.0) return {scenario_.motion(stamp).T_world_body};
    std::vector<SE3> poses;
    for (int row = 0; row < height; ++row)
      poses.push_back(
          scenario_.motion(stamp + nanoseconds(row_delay_s(config, row, height))).T_world_body);
    return poses;
  }

  [[nodiscard]] std::vector<std::uint8_t> encoded(ImageChannel channel, std::size_t i,
                                                  const RenderedView& left,
                                                  const MovedSurfaces* moved) const {
    const Shot taken = shot(i, channel);
    switch (channel) {
      case ImageChannel::kLeft:
        return encode_gray(left_effects_.gray(left, taken));
      case ImageChannel::kRight: {
        const RenderedView right = renderer_.render(right_, row_poses(i, right_.camera().height),
                                                    right_effects_.request(), moved);
        return encode_gray(right_effects_.gray(right, taken));
      }
      case ImageChannel::kDepth:
        return encode_depth(left.width, left.height,
                            measured_depth(left.depth_m, left.width, left.height, taken.noise_seed,
                                           depth_sensor(scenario_.rig)));
      case ImageChannel::kLabels:
        break;
    }
    return encode_labels(left.width, left.height, left.labels);
  }

  const RobotScenario& scenario_;
  const Renderer& renderer_;
  const Traffic& traffic_;
  const SimulationOptions& options_;
  std::size_t depth_step_ = 0;  // number of frames between depth images, 0: no depth images
  RecordingLayout layout_;
  PixelRays left_;
  PixelRays right_;
  PixelRays meter_;
  SensorEffects left_effects_;
  SensorEffects right_effects_;
  LightPassages passages_;
  std::vector<Exposure> exposures_;
};

// One run: the world, the robots, and the cameras that fill the folder.
class Simulation {
 public:
  // Both arguments outlive this.
  Simulation(const SimulationOptions& options, const std::vector<RecordedFlight>& flights)
      : options_(options),
        world_(make_world(options)),
        renderer_(world_),
        robots_(options.is_recorded() ? recorded_robots(flights, options)
                                      : simulated_robots(world_, options)),
        traffic_(planned_traffic()) {
    for (const RobotScenario& robot : robots_) {
      cameras_.push_back(std::make_unique<RobotCameras>(robot, options_, renderer_, traffic_));
      for (std::size_t i = 0; i < robot.images.size(); ++i)
        frames_.push_back({cameras_.size() - 1, i});
    }
  }

  void record() {
    std::cout << "World " << world_.name << " with " << world_.mesh.triangles.size()
              << " triangles; " << frames_.size() << " frames of " << robots_.size()
              << " robots to " << options_.output.string() << std::endl;
    write_surroundings();
    meter();
    record_frames();
    // The lists of images are written last, so that an interrupted recording has none and is
    // refused.
    for (const auto& cameras : cameras_) write_lists(*cameras);
    write_whole_file(options_.output / "team.yaml", team_yaml());
  }

 private:
  struct Frame {
    std::size_t robot;
    std::size_t index;
  };

  [[nodiscard]] Traffic planned_traffic() const {
    std::vector<RobotWay> ways;
    double duration_s = 0.0;
    for (const RobotScenario& robot : robots_) {
      ways.emplace_back([&robot](double t_s) {
        return robot.motion(robot.images.front() + nanoseconds(t_s)).T_world_body;
      });
      duration_s = std::max(duration_s, robot.duration_s());
    }
    return make_traffic(world_, options_.effects.traffic, ways, duration_s,
                        derived_seed(options_.seed, kTraffic));
  }

  void write_surroundings() const {
    const std::string palette = to_csv(simulation_palette());
    write_whole_file(options_.output / "label_palette.csv", palette);
    write_whole_file(options_.output / "world.ply", world_ply(world_, simulation_palette()));
    write_whole_file(options_.output / "objects.json",
                     true_objects_json(world_, simulation_palette()));
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      const RecordingLayout& layout = cameras_[r]->layout();
      write_calibration(r);
      write_whole_file(layout.mav0() / "label_palette.csv", palette);
      write_whole_file(layout.imu() / "data.csv", imu_csv(robots_[r].imu));
      write_whole_file(layout.truth(), state_csv(robots_[r].truth));
    }
  }

  void write_calibration(std::size_t r) const {
    const RecordingLayout& layout = cameras_[r]->layout();
    const SensorRig& rig = robots_[r].told_rig;
    const Camera& left = rig.stereo.cameras[0];
    const std::string comment = "simulated, world " + world_.name;
    const auto write = [&](ImageChannel channel, const std::string& text) {
      if (!cameras_[r]->stamps(channel).empty())
        write_whole_file(layout.calibration(channel), text);
    };
    write(ImageChannel::kLeft, camera_yaml(left, options_.rate_hz, comment));
    write(ImageChannel::kRight, camera_yaml(rig.stereo.cameras[1], options_.rate_hz, comment));
    const DepthSensorOptions depth = depth_sensor(rig);
    write(ImageChannel::kDepth, depth_yaml(left,
                                           {.rate_hz = options_.depth_rate_hz,
                                            .min_range_m = depth.min_range_m,
                                            .max_range_m = depth.max_range_m,
                                            .baseline_m = depth.baseline_m},
                                           comment));
    write_whole_file(layout.imu() / "sensor.yaml",
                     imu_yaml(rig.imu, options_.is_recorded() ? "recorded" : "simulated"));
  }

  // The exposure of a frame depends on the frames before it: one thread for each robot.
  void meter() const {
    run_parallel(options_.threads, robots_.size(), [this](std::size_t r) {
      RobotCameras& cameras = *cameras_[r];
      ExposureControl control(options_.effects.sensor, options_.rate_hz);
      std::vector<Exposure> exposures;
      for (std::size_t i = 0; i < cameras.frame_count(); ++i)
        exposures.push_back(control.next(cameras.meter(i), cameras.light(i)));
      cameras.set_exposures(std::move(exposures));
    });
  }

  void record_frames() const {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::seconds kReportInterval(3);
    const Clock::time_point start = Clock::now();
    Clock::time_point reported = start;
    std::mutex mutex;  // guards `reported` and `done`
    std::size_t done = 0;
    const std::size_t all = frames_.size();
    run_parallel(options_.threads, all, [&](std::size_t i) {
      cameras_[frames_[i].robot]->record(frames_[i].index);
      const std::lock_guard lock(mutex);
      const Clock::time_point now = Clock::now();
      if (++done < all && now - reported < kReportInterval) return;
      reported = now;
      std::cout << done << " of " << all << " frames, " << 100 * done / all << " %";
      const auto rest = (now - start) * (all - done) / done;
      if (done < all)
        std::cout << ", " << std::chrono::ceil<std::chrono::seconds>(rest).count() << " s left";
      std::cout << std::endl;
    });
  }

  static void write_lists(const RobotCameras& cameras) {
    for (const ImageChannel channel : kImageChannels) {
      const auto stamps = cameras.stamps(channel);
      if (!stamps.empty())
        write_whole_file(cameras.layout().list(channel),
                         image_csv(stamps, RecordingLayout::image_extension(channel)));
    }
  }

  // The robots, their true poses and the true mesh, for kimera_multi_team. Robots with depth build
  // a map, with labels if those were recorded.
  [[nodiscard]] std::string team_yaml() const {
    std::string text =
        "# The robots of these recordings:\n"
        "#   kimera_multi_team --config team.yaml --output results\n"
        "truth_mesh: world.ply\n";
    std::vector<std::string> settings;
    if (options_.depth)
      settings.push_back(std::string("mapping.mode=") + (options_.labels ? "semantic" : "metric"));
    if (options_.depth && options_.world == WorldKind::kViconRoom)
      settings.emplace_back("semantic_mapping.voxel_size_m=0.05");
    if (!options_.is_recorded() && !options_.is_disturbed()) {
      text +=
          "# Simulated sensors are as their calibration states: odometry drifts less than the "
          "default.\n";
      settings.insert(settings.end(), {"vio.drift_rotation=2e-4", "vio.drift_translation=0.001"});
    }
    for (std::size_t i = 0; i < settings.size(); ++i)
      text += (i == 0 ? "arguments: [--set, " : ", --set, ") + settings[i];
    text += settings.empty() ? "robots:\n" : "]\nrobots:\n";
    for (std::size_t i = 0; i < options_.names.size(); ++i) {
      const std::string& name = options_.names[i];
      text += "  - id: " + std::to_string(i) + "\n    name: \"" + name + "\"\n    dataset: \"" +
              name + "\"\n    truth: \"" + name + "/mav0/state_groundtruth_estimate0/data.csv\"\n";
    }
    return text;
  }

  const SimulationOptions& options_;
  World world_;
  Renderer renderer_;
  std::vector<RobotScenario> robots_;
  Traffic traffic_;
  std::vector<std::unique_ptr<RobotCameras>> cameras_;
  std::vector<Frame> frames_;  // frames of all robots
};

}  // namespace

void simulate(const SimulationOptions& options) {
  DatasetRecord record{.generator = "kimera_multi_simulate " + built_version(),
                       .parameters = parameters(options)};
  std::vector<RecordedFlight> flights;
  for (std::size_t i = 0; i < options.truths.size(); ++i) {
    flights.push_back(read_recorded_flight(options.truths[i], options.imus[i]));
    record.parameters.emplace_back("recording " + options.names[i], flights.back().fingerprint);
  }
  record = open_dataset(options.output, record);
  if (record.complete) {
    std::cout << options.output.string() << " is complete already; nothing to do" << std::endl;
    return;
  }
  Simulation(options, flights).record();
  record.complete = true;
  write_record(options.output, record);
}

}  // namespace km
