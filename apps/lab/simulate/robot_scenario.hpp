#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/simulate/recorded_flight.hpp"
#include "apps/lab/simulate/simulation_options.hpp"
#include "apps/lab/simulation/dataset/recording_texts.hpp"
#include "apps/lab/simulation/motion/inertial_errors.hpp"
#include "apps/lab/simulation/motion/robot_clock.hpp"
#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"

namespace km {

/// The motion of one robot through the world, and all parts of its recording except for the images.
struct RobotScenario {
  std::string name;
  std::uint64_t seed = 0;  ///< Seed of its noise.
  SensorRig rig;           ///< The true one.
  SensorRig told_rig;      ///< The calibration that the robot gets.
  InertialErrors inertial_errors;
  std::unique_ptr<const BodyTrajectory> trajectory;
  Stamp epoch = 0;  ///< Time 0 of the trajectory.
  std::vector<ImuSample> imu;
  std::vector<TrueState> truth;
  std::vector<Stamp> images;        ///< True times of the images.
  std::vector<Stamp> image_stamps;  ///< Stamps of the images by the cameras' clock.
  std::optional<RobotClock> clock;  ///< Gave the stamps of images, `imu` and `truth`.

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
/// ones. Throws std::invalid_argument if no part of a flight is between start and end.
[[nodiscard]] std::vector<RobotScenario> recorded_robots(const std::vector<RecordedFlight>& flights,
                                                         const SimulationOptions& options);

/// A seed for part `part` of the random numbers that `seed` determines.
[[nodiscard]] std::uint64_t derived_seed(std::uint64_t seed, std::uint64_t part);

}  // namespace km
