#include "apps/lab/simulate/simulate.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <vector>

#include "apps/lab/simulate/dataset_folder.hpp"
#include "apps/lab/simulate/dataset_texts.hpp"
#include "apps/lab/simulate/frame_workers.hpp"
#include "apps/lab/simulate/recorded_flight.hpp"
#include "apps/lab/simulate/robot_scenario.hpp"
#include "apps/lab/simulation/dataset/recording_files.hpp"
#include "apps/lab/simulation/dataset/recording_texts.hpp"
#include "apps/lab/simulation/motion/default_rig.hpp"
#include "apps/lab/simulation/motion/depth_sensor.hpp"
#include "apps/lab/simulation/motion/traffic.hpp"
#include "apps/lab/simulation/rendering/light_passages.hpp"
#include "apps/lab/simulation/rendering/moved_surfaces.hpp"
#include "apps/lab/simulation/rendering/renderer.hpp"
#include "apps/lab/simulation/rendering/sensor_effects.hpp"
#include "apps/program_version.hpp"
#include "modules/core/bytes.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr double kPoll_s = 0.1;
// Parts of a robot's seed; robot_scenario.cpp has those below 16, channels have 16 to 20.
constexpr std::uint64_t kLeftDirt = 32, kRightDirt = 33, kPassages = 34, kRain = 35;
constexpr std::uint64_t kTraffic = 1000;  // part of the run's seed; robots have those below

World make_world(const SimulationOptions& options) {
  switch (options.world) {
    case WorldKind::kCity:
      return options.effects.places.alike ? make_uniform_city(options.seed)
                                          : make_city(options.seed);
    case WorldKind::kCamp:
      return make_camp(options.seed);
    case WorldKind::kStore:
      return make_store(options.seed);
    case WorldKind::kHall:
      return make_hall(options.seed);
    case WorldKind::kViconRoom:
      break;
  }
  return make_vicon_room(options.seed);
}

// Bytes of one frame's images: a little above the measured sizes in city, camp and room.
double frame_bytes(const SimulationOptions& options) {
  const double pixels = static_cast<double>(options.width) * options.height;
  const double gray = options.format == ImageFormat::kJpeg ? 0.5 : 0.7;
  double bytes = gray * (options.cameras == CameraKind::kStereo ? 2.0 : 1.0);
  if (options.depth) bytes += 0.45 * options.depth_rate_hz / options.rate_hz;
  if (options.labels) bytes += 0.05;
  if (options.color) bytes += 1.3 * gray;
  return bytes * pixels;
}

// Fingerprint of all files that describe a rig.
std::string fingerprint(const SensorRig& rig) {
  const std::string text = camera_yaml(rig.stereo.cameras[0], 1.0, "left") +
                           camera_yaml(rig.stereo.cameras[1], 1.0, "right") +
                           imu_yaml(rig.imu, "imu");
  std::uint64_t hash = kFnv1aBasis;
  for (const char c : text) mix_fnv1a(hash, static_cast<std::uint64_t>(c));
  std::ostringstream digits;
  digits << "fnv1a " << std::hex << hash;
  return digits.str();
}

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

// Channels of a frame, with or without a depth image.
std::vector<ImageChannel> channels_of(const SimulationOptions& options, bool depth) {
  std::vector<ImageChannel> channels = {ImageChannel::kLeft};
  if (options.cameras == CameraKind::kStereo) channels.push_back(ImageChannel::kRight);
  if (depth) channels.push_back(ImageChannel::kDepth);
  if (options.labels) channels.push_back(ImageChannel::kLabels);
  if (options.color) channels.push_back(ImageChannel::kColor);
  return channels;
}

SensorEffectsConfig sensor_effects(const SimulationOptions& options) {
  SensorEffectsConfig config = options.effects.sensor;
  config.motion_blur = config.motion_blur || options.motion_blur;
  return config;
}

// True if any effect makes the recordings harder than at level 0.
bool is_disturbed(const SimulationOptions& options) {
  return !changed_keys(options.effects, 0).empty();
}

// Files with the truth that a robot does not get.
std::vector<fs::path> truth_files(const SimulationOptions& options, const std::string& robot) {
  const fs::path folder = options.output / robot / "truth";
  return {folder / "cam0.yaml", folder / "cam1.yaml", folder / "errors.yaml",
          folder / "image_times.csv"};
}

std::size_t missing_of(const std::vector<fs::path>& files) {
  std::size_t missing = 0;
  for (const fs::path& file : files) missing += fs::exists(file) ? 0U : 1U;
  return missing;
}

std::size_t missing_images(const RecordingLayout& layout, ImageChannel channel) {
  std::ifstream list(layout.list(channel));
  if (!list) return 1;
  std::size_t missing = 0;
  for (std::string line; std::getline(list, line);) {
    Stamp stamp = 0;
    const bool is_row =
        std::from_chars(line.data(), line.data() + line.size(), stamp).ec == std::errc();
    if (is_row && !is_whole_image(layout.image(channel, stamp))) ++missing;
  }
  return missing;
}

// Number of files of the recordings made with `options` (completed()) that are missing, or are
// truncated images. If an image list is missing, its images are not counted, because only the list
// names them.
std::size_t missing_files(const SimulationOptions& options) {
  const fs::path& folder = options.output;
  std::size_t missing =
      missing_of({folder / "README.md", folder / "team.yaml", folder / "label_palette.csv",
                  folder / "world.ply", folder / "objects.json"});
  if (is_disturbed(options)) missing += missing_of({folder / "effects.yaml"});
  for (const std::string& name : options.names) {
    const RecordingLayout layout(folder / name, options.format);
    missing += missing_of({layout.mav0() / "label_palette.csv", layout.imu() / "data.csv",
                           layout.imu() / "sensor.yaml", layout.truth()});
    if (is_disturbed(options)) missing += missing_of(truth_files(options, name));
    for (const ImageChannel channel : channels_of(options, options.depth)) {
      missing += missing_images(layout, channel);
      if (channel != ImageChannel::kLabels) missing += missing_of({layout.calibration(channel)});
    }
  }
  return missing;
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
        layout_(options.output / scenario.name, options.format),
        left_(scenario.rig.stereo.cameras[0]),
        right_(scenario.rig.stereo.cameras[1]),
        meter_(shrunk(scenario.rig.stereo.cameras[0], ExposureControl::kMeterShrink)),
        left_effects_(left_, sensor_effects(options), derived_seed(scenario.seed, kLeftDirt)),
        right_effects_(right_, sensor_effects(options), derived_seed(scenario.seed, kRightDirt)),
        passages_(sensor_effects(options), scenario.duration_s(),
                  derived_seed(scenario.seed, kPassages)),
        depth_sensor_(depth_sensor(scenario.rig, options.ideal_depth)) {}

  [[nodiscard]] const RecordingLayout& layout() const { return layout_; }
  [[nodiscard]] std::size_t frame_count() const { return scenario_.images.size(); }

  // Channels of frame `i`.
  [[nodiscard]] std::vector<ImageChannel> channels(std::size_t i) const {
    return channels_of(options_, depth_step_ > 0 && i % depth_step_ == 0);
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

  // Renders frame `i` and writes the images that are missing. Throws RecordingError.
  void record(std::size_t i) const {
    const Stamp stamp = scenario_.image_stamps[i];
    std::vector<ImageChannel> missing = channels(i);
    std::erase_if(missing, [&](ImageChannel channel) {
      return is_whole_image(layout_.image(channel, stamp));
    });
    if (missing.empty()) return;

    const std::unique_ptr<const MovedSurfaces> moved = moved_surfaces(i);
    RenderRequest request = {false, false, false, false};
    if (contains(missing, ImageChannel::kLeft)) request = left_effects_.request(false);
    if (contains(missing, ImageChannel::kColor))
      request = merged(request, left_effects_.request(true));
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
    Shot shot;
    shot.exposure = exposures_.at(i);
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
        return encode_gray(left_effects_.gray(left, taken), options_.format);
      case ImageChannel::kRight: {
        const RenderedView right = renderer_.render(right_, row_poses(i, right_.camera().height),
                                                    right_effects_.request(false), moved);
        return encode_gray(right_effects_.gray(right, taken), options_.format);
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
    return encode_color(color.width, color.height, color.pixels, options_.format);
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
  DepthSensor depth_sensor_;
  std::vector<Exposure> exposures_;
};

// One run: the content of the folder, the robots, and the cameras that fill it.
class Simulation {
 public:
  // All arguments except for `record` outlive this.
  Simulation(const SimulationOptions& options, DatasetFolder& folder, DatasetRecord record,
             const std::vector<RecordedFlight>& flights)
      : options_(options), folder_(folder), record_(std::move(record)), flights_(flights) {}

  // Prepares everything that frames need, and writes all parts of the recordings except for images
  // and their lists. False after a signal, which ends it after the present step.
  bool prepare(SignalWatch& signals) {
    const double start_s = steady_now_s();
    std::cout << "Preparing world " << name_of(options_.world) << " ..." << std::endl;
    const std::array<std::function<void()>, 5> steps = {
        [this] { world_.emplace(make_world(options_)); }, [this] { renderer_.emplace(*world_); },
        [this] { place_robots(); }, [this] { write_surroundings(); }, [this] { meter(); }};
    FrameWorkers worker(1, steps.size(), [&steps](std::size_t i) { steps[i](); });
    while (!worker.is_finished())
      if (stop_if_asked(worker, signals))
        std::cout << "Stopping after this step; Ctrl-C again ends it at once" << std::endl;
    worker.join();
    if (stopped_) return false;
    announce(steady_now_s() - start_s);
    return true;
  }

  SimulationOutcome record_frames(SignalWatch& signals, Progress& progress) {
    progress.start(0, frames_.size(), steady_now_s());
    FrameWorkers workers(options_.threads, frames_.size(), [this](std::size_t i) {
      cameras_[frames_[i].robot]->record(frames_[i].index);
      --*remaining_[frames_[i].robot];
      ++done_;
    });
    try {
      while (!workers.is_finished()) {
        stop_if_asked(workers, signals);
        progress.update(done_, steady_now_s());
        finish_robots();
      }
      workers.join();
      finish_robots();
    } catch (...) {
      progress.finish(done_, steady_now_s());  // gives the message a line of its own
      throw;
    }
    progress.finish(done_, steady_now_s());
    return stopped_ && done_ < frames_.size() ? SimulationOutcome::kInterrupted
                                              : SimulationOutcome::kComplete;
  }

  void complete() {
    write_whole_file(folder_.path() / "README.md",
                     dataset_readme(options_, record_, *world_, robots_));
    write_whole_file(folder_.path() / "team.yaml", team_yaml(options_));
    folder_.mark_complete();
  }

 private:
  struct Frame {
    std::size_t robot;
    std::size_t index;
  };

  void place_robots() {
    robots_ = options_.is_recorded() ? recorded_robots(flights_, options_)
                                     : simulated_robots(*world_, options_);
    place_traffic();
    for (const RobotScenario& robot : robots_) {
      cameras_.push_back(std::make_unique<RobotCameras>(robot, options_, *renderer_, traffic_));
      for (std::size_t i = 0; i < robot.images.size(); ++i)
        frames_.push_back({cameras_.size() - 1, i});
      remaining_.push_back(std::make_unique<std::atomic<std::size_t>>(robot.images.size()));
    }
    is_finished_.resize(robots_.size(), false);
  }

  void place_traffic() {
    std::vector<RobotWay> ways;
    double duration_s = 0.0;
    for (const RobotScenario& robot : robots_) {
      ways.emplace_back([&robot](double t_s) {
        return robot.motion(robot.images.front() + nanoseconds(t_s)).T_world_body;
      });
      duration_s = std::max(duration_s, robot.duration_s());
    }
    traffic_ = make_traffic(*world_, options_.effects.traffic, ways, duration_s,
                            derived_seed(options_.seed, kTraffic));
  }

  void write_surroundings() const {
    const std::string palette = to_csv(simulation_palette());
    write_whole_file(folder_.path() / "label_palette.csv", palette);
    write_whole_file(folder_.path() / "world.ply", world_ply(*world_, simulation_palette()));
    write_whole_file(folder_.path() / "objects.json",
                     true_objects_json(*world_, simulation_palette()));
    if (is_disturbed(options_))
      write_whole_file(folder_.path() / "effects.yaml", effects_yaml(options_.effects));
    if (!traffic_.ways.empty())
      write_whole_file(folder_.path() / "traffic.csv", traffic_csv(traffic_, robots_));
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      const RecordingLayout& layout = cameras_[r]->layout();
      write_calibration(r);
      if (is_disturbed(options_)) write_truth(r);
      write_whole_file(layout.mav0() / "label_palette.csv", palette);
      write_whole_file(layout.imu() / "data.csv", imu_csv(robots_[r].imu));
      write_whole_file(layout.truth(), state_csv(robots_[r].truth));
    }
  }

  // The exposure of a frame depends on the frames before it: one thread for each robot.
  void meter() const {
    FrameWorkers workers(options_.threads, robots_.size(), [this](std::size_t r) {
      RobotCameras& cameras = *cameras_[r];
      ExposureControl control(sensor_effects(options_), options_.rate_hz);
      std::vector<Exposure> exposures;
      for (std::size_t i = 0; i < cameras.frame_count() && !stopped_; ++i)
        exposures.push_back(control.next(cameras.meter(i), cameras.light(i)));
      cameras.set_exposures(std::move(exposures));
    });
    workers.join();
  }

  void announce(double prepared_s) const {
    std::cout << "World " << world_->name << " with " << world_->mesh.triangles.size()
              << " triangles, ready after " << duration_text(prepared_s) << "; " << frames_.size()
              << " frames of " << robots_.size() << " robots to " << folder_.path().string()
              << std::endl;
    const double needed = frame_bytes(options_) * static_cast<double>(frames_.size());
    const auto available = static_cast<double>(folder_.free_space());
    if (!folder_.is_resumed() && needed > available)
      std::cerr << "kimera_multi_simulate: warning: this takes about " << size_text(needed)
                << ", and the disk has " << size_text(available) << " left" << std::endl;
  }

  bool stop_if_asked(FrameWorkers& workers, SignalWatch& signals) {
    if (!signals.wait(kPoll_s)) return false;
    stopped_ = true;
    workers.stop();
    signals.give_up();  // a second signal ends the program at once
    return true;
  }

  void write_calibration(std::size_t r) const {
    const RecordingLayout& layout = cameras_[r]->layout();
    const SensorRig& rig = robots_[r].told_rig;
    const Camera& left = rig.stereo.cameras[0];
    const std::string comment = std::string("simulated, world ") + world_->name;
    const auto write = [&](ImageChannel channel, const std::string& text) {
      if (!cameras_[r]->stamps(channel).empty())
        write_whole_file(layout.calibration(channel), text);
    };
    write(ImageChannel::kLeft, camera_yaml(left, options_.rate_hz, comment));
    write(ImageChannel::kRight, camera_yaml(rig.stereo.cameras[1], options_.rate_hz, comment));
    write(ImageChannel::kColor, camera_yaml(left, options_.rate_hz, comment));
    write(ImageChannel::kDepth, depth_yaml(left, depth_figures(rig), comment));
    const bool recorded = options_.is_recorded();
    write_whole_file(layout.imu() / "sensor.yaml",
                     imu_yaml(rig.imu, recorded ? "recorded" : "simulated"));
  }

  // The robot does not get these files.
  void write_truth(std::size_t r) const {
    const RobotScenario& robot = robots_[r];
    const std::vector<fs::path> files = truth_files(options_, robot.name);
    const std::string comment = "true calibration";
    write_whole_file(files[0], camera_yaml(robot.rig.stereo.cameras[0], options_.rate_hz, comment));
    write_whole_file(files[1], camera_yaml(robot.rig.stereo.cameras[1], options_.rate_hz, comment));
    write_whole_file(files[2], true_errors_yaml(robot));
    write_whole_file(files[3], true_times_csv(robot));
  }

  DepthCameraFigures depth_figures(const SensorRig& rig) const {
    DepthCameraFigures figures;
    figures.rate_hz = options_.depth_rate_hz;
    figures.baseline_m = rig.stereo.baseline_m();
    if (options_.ideal_depth) return figures;
    const DepthSensorOptions sensor = depth_options(rig);
    figures.min_range_m = sensor.min_range_m;
    figures.max_range_m = sensor.max_range_m;
    return figures;
  }

  // The lists of images are written last, so that an interrupted recording has none and is refused.
  void finish_robots() {
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      if (is_finished_[r] || *remaining_[r] > 0) continue;
      const RobotCameras& cameras = *cameras_[r];
      for (const ImageChannel channel : kImageChannels) {
        const auto stamps = cameras.stamps(channel);
        if (stamps.empty()) continue;
        write_whole_file(cameras.layout().list(channel),
                         image_csv(stamps, cameras.layout().image_extension(channel)));
      }
      is_finished_[r] = true;
      folder_.mark_finished(robots_[r].name);
    }
  }

  const SimulationOptions& options_;
  DatasetFolder& folder_;
  DatasetRecord record_;
  const std::vector<RecordedFlight>& flights_;
  std::optional<World> world_;
  std::optional<Renderer> renderer_;
  std::vector<RobotScenario> robots_;
  Traffic traffic_;
  std::vector<std::unique_ptr<RobotCameras>> cameras_;
  std::vector<Frame> frames_;  // frames of all robots
  std::vector<std::unique_ptr<std::atomic<std::size_t>>> remaining_;
  std::vector<bool> is_finished_;
  std::atomic<std::size_t> done_ = 0;
  std::atomic<bool> stopped_ = false;  // true after a signal
};

}  // namespace

SimulationOutcome simulate(const SimulationOptions& options, SignalWatch& signals,
                           Progress& progress) {
  DatasetRecord record;
  record.generator = "kimera_multi_simulate " + built_version();
  record.parameters = parameters(options);
  std::vector<RecordedFlight> flights;
  for (std::size_t i = 0; i < options.truths.size(); ++i) {
    flights.push_back(read_recorded_flight(options.truths[i], options.imus[i], options.steady));
    record.parameters.emplace_back("recording " + options.names[i], flights.back().fingerprint);
  }
  if (options.rig)
    record.parameters.emplace_back("recording calibration", fingerprint(*options.rig));
  DatasetFolder folder(options.output, record);
  if (folder.is_complete()) {
    const std::size_t missing = missing_files(options);
    if (missing == 0) {
      std::cout << folder.path().string() << " is complete already; nothing to do" << std::endl;
      return SimulationOutcome::kComplete;
    }
    std::cout << folder.path().string() << " was complete, but is no longer: " << missing
              << (missing == 1 ? " file is" : " files are") << " missing" << std::endl;
    folder.mark_incomplete();
  }
  Simulation simulation(options, folder, record, flights);
  if (!simulation.prepare(signals)) return SimulationOutcome::kInterrupted;
  const SimulationOutcome outcome = simulation.record_frames(signals, progress);
  if (outcome == SimulationOutcome::kComplete) simulation.complete();
  return outcome;
}

}  // namespace km
