#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "apps/simulate/recorded_flight.hpp"
#include "apps/simulate/simulation_options.hpp"
#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/simulation/dataset/recording_texts.hpp"
#include "modules/simulation/motion/spline_trajectory.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// One robot's way through the world and everything of its recording but the images.
struct RobotScenario {
  std::string name;
  std::uint64_t seed = 0;  ///< Of its noise.
  SensorRig rig;
  std::unique_ptr<const BodyTrajectory> trajectory;
  Stamp epoch = 0;  ///< Time 0 of the trajectory.
  std::vector<ImuSample> imu;
  std::vector<TrueState> truth;
  std::vector<Stamp> images;  ///< Stamps.

  [[nodiscard]] BodyMotion motion(Stamp stamp) const {
    return trajectory->motion(seconds_between(epoch, stamp));
  }
};

/// The robots that drive or fly through `world`; inertial data start kImuLead_s before the images.
[[nodiscard]] std::vector<RobotScenario> simulated_robots(const World& world,
                                                          const SimulationOptions& options);

/// The robots that move as `flights` were recorded; inertial data and true states are the recorded
/// ones. Throws std::invalid_argument if nothing of a flight lies between start and end.
[[nodiscard]] std::vector<RobotScenario> recorded_robots(const std::vector<RecordedFlight>& flights,
                                                         const SimulationOptions& options);

/// A seed for part `part` of what `seed` is for.
[[nodiscard]] std::uint64_t derived_seed(std::uint64_t seed, std::uint64_t part);

}  // namespace km
