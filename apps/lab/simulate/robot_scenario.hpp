#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "apps/lab/simulate/recorded_flight.hpp"
#include "apps/lab/simulate/simulation_options.hpp"
#include "apps/lab/simulation/dataset/recording_texts.hpp"
#include "apps/lab/simulation/motion/spline_trajectory.hpp"
#include "apps/lab/simulation/world/world.hpp"
#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"

namespace km {

/// The motion of one robot through the world, and all parts of its recording except for the images.
struct RobotScenario {
  std::string name;
  std::uint64_t seed = 0;  ///< Seed of its noise.
  SensorRig rig;
  std::unique_ptr<const BodyTrajectory> trajectory;
  Stamp epoch = 0;  ///< Time 0 of the trajectory.
  std::vector<ImuSample> imu;
  std::vector<TrueState> truth;
  std::vector<Stamp> images;  ///< Stamps of the images.

  [[nodiscard]] BodyMotion motion(Stamp stamp) const {
    return trajectory->motion(seconds_between(epoch, stamp));
  }
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
