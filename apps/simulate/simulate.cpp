#include "apps/simulate/simulate.hpp"

#include <array>
#include <atomic>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <vector>

#include "apps/simulate/dataset_folder.hpp"
#include "apps/simulate/dataset_texts.hpp"
#include "apps/simulate/frame_workers.hpp"
#include "apps/simulate/missing_files.hpp"
#include "apps/simulate/recorded_flight.hpp"
#include "apps/simulate/robot_cameras.hpp"
#include "modules/simulation/dataset/sensor_yaml.hpp"
#include "modules/simulation/dataset/whole_file.hpp"
#include "modules/simulation/dataset/world_ply.hpp"
#include "modules/simulation/motion/default_rig.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

constexpr double kPoll_s = 0.1;

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

// Bytes of one frame's images: a little above what pixels took in city, camp and room.
double frame_bytes(const SimulationOptions& options) {
  const double pixels = static_cast<double>(options.width) * options.height;
  const double gray = options.format == ImageFormat::kJpeg ? 0.5 : 0.7;
  double bytes = gray * (options.cameras == CameraKind::kStereo ? 2.0 : 1.0);
  if (options.depth) bytes += 0.45 * options.depth_rate_hz / options.rate_hz;
  if (options.labels) bytes += 0.05;
  if (options.color) bytes += 1.3 * gray;
  return bytes * pixels;
}

// One run: what the folder holds, who drives, and the cameras that fill it.
class Simulation {
 public:
  // All but `record` outlive this.
  Simulation(const SimulationOptions& options, DatasetFolder& folder, DatasetRecord record,
             const std::vector<RecordedFlight>& flights)
      : options_(options), folder_(folder), record_(std::move(record)), flights_(flights) {}

  // Everything the frames need, and everything of the recordings but images and their lists; false
  // if a signal came, which ends it after the step under way.
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
      progress.finish(done_, steady_now_s());  // the message gets a line of its own
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
    for (const RobotScenario& robot : robots_) {
      cameras_.push_back(std::make_unique<RobotCameras>(robot, options_, *renderer_));
      for (std::size_t i = 0; i < robot.images.size(); ++i)
        frames_.push_back({cameras_.size() - 1, i});
      remaining_.push_back(std::make_unique<std::atomic<std::size_t>>(robot.images.size()));
    }
    is_finished_.resize(robots_.size(), false);
  }

  void write_surroundings() const {
    const std::string palette = to_csv(simulation_palette());
    write_whole_file(folder_.path() / "label_palette.csv", palette);
    write_whole_file(folder_.path() / "world.ply", world_ply(*world_, simulation_palette()));
    for (std::size_t r = 0; r < robots_.size(); ++r) {
      const RecordingLayout& layout = cameras_[r]->layout();
      write_calibration(r);
      write_whole_file(layout.mav0() / "label_palette.csv", palette);
      write_whole_file(layout.imu() / "data.csv", imu_csv(robots_[r].imu));
      write_whole_file(layout.truth(), state_csv(robots_[r].truth));
    }
  }

  // The exposure of a frame depends on those before it: one thread for each robot.
  void meter() const {
    FrameWorkers workers(options_.threads, robots_.size(), [this](std::size_t r) {
      RobotCameras& cameras = *cameras_[r];
      ExposureControl control(sensor_effects(options_), options_.rate_hz);
      std::vector<Exposure> exposures;
      for (std::size_t i = 0; i < cameras.frame_count() && !stopped_; ++i)
        exposures.push_back(control.next(cameras.meter(i)));
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
    signals.give_up();  // a second one ends at once
    return true;
  }

  void write_calibration(std::size_t r) const {
    const RecordingLayout& layout = cameras_[r]->layout();
    const SensorRig& rig = robots_[r].rig;
    const PinholeCamera& left = rig.stereo.cameras[0];
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

  // The lists come last: a recording without them is none.
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
  std::vector<std::unique_ptr<RobotCameras>> cameras_;
  std::vector<Frame> frames_;  // of all robots
  std::vector<std::unique_ptr<std::atomic<std::size_t>>> remaining_;
  std::vector<bool> is_finished_;
  std::atomic<std::size_t> done_ = 0;
  std::atomic<bool> stopped_ = false;  // by a signal
};

}  // namespace

SimulationOutcome simulate(const SimulationOptions& options, SignalWatch& signals,
                           Progress& progress) {
  DatasetRecord record;
  record.generator = "kimera_multi_simulate " KM_VERSION;
  record.parameters = parameters(options);
  std::vector<RecordedFlight> flights;
  for (std::size_t i = 0; i < options.truths.size(); ++i) {
    flights.push_back(read_recorded_flight(options.truths[i], options.imus[i]));
    record.parameters.emplace_back("recording " + options.names[i], flights.back().fingerprint);
  }
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
