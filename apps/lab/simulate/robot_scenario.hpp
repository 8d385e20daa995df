#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/lab/simulate/simulation_options.hpp"
#include "apps/lab/simulation/dataset/recording.hpp"
#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"

namespace km {

/// A recorded motion: true states and inertial samples.
struct RecordedFlight {
  std::vector<TrueState> truth;  ///< Velocity and biases are zero if the file has none.
  std::vector<ImuSample> imu;
  std::string fingerprint;  ///< Names and check sums of both files.
};

/// Reads true poses (EuRoC's state CSV) and inertial data (EuRoC's CSV); both may be gzipped. Rows
/// that repeat the stamp of the row before are left out, because published truths have some. Throws
/// std::runtime_error that names file and line for unusable rows, and for files that do not overlap
/// in time.
[[nodiscard]] RecordedFlight read_recorded_flight(const std::filesystem::path& truth,
                                                  const std::filesystem::path& imu);

/// The motion of one robot through the world, and all parts of its recording except for the images.
struct RobotScenario {
  std::string name;
  std::uint64_t seed = 0;  ///< Seed of its noise.
  SensorRig rig;           ///< The true one.
  SensorRig told_rig;      ///< The calibration that the robot gets.
  std::unique_ptr<const BodyTrajectory> trajectory;
  Stamp epoch = 0;  ///< Time 0 of the trajectory.
  std::vector<ImuSample> imu;
  std::vector<TrueState> truth;
  std::vector<Stamp> images;        ///< True times of the images.
  std::vector<Stamp> image_stamps;  ///< Stamps of the images by the cameras' clock.

  /// A time before or after the trajectory has the motion of its begin or end.
  [[nodiscard]] BodyMotion motion(Stamp true_time) const {
    return trajectory->motion(
        std::clamp(seconds_between(epoch, true_time), trajectory->start_s(), trajectory->end_s()));
  }
  /// From the first image to the last one.
  [[nodiscard]] double duration_s() const { return seconds_between(images.front(), images.back()); }
};

/// The robots that drive or fly through `world`; inertial data start kImuLead_s before the images.
[[nodiscard]] std::vector<RobotScenario> simulated_robots(const World& world,
                                                          const SimulationOptions& options);

/// The robots with the recorded motion of `flights`; inertial data and true states are the recorded
/// ones. Throws std::invalid_argument for a flight without an inertial sample before its end.
[[nodiscard]] std::vector<RobotScenario> recorded_robots(const std::vector<RecordedFlight>& flights,
                                                         const SimulationOptions& options);

/// A seed for part `part` of the random numbers that `seed` determines.
[[nodiscard]] std::uint64_t derived_seed(std::uint64_t seed, std::uint64_t part);

}  // namespace km
