#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "apps/robot/mapping_plan.hpp"
#include "apps/robot/robot_config.hpp"
#include "modules/core/camera_calibration.hpp"
#include "modules/journal/restored_run.hpp"
#include "modules/mesh/continued_map.hpp"
#include "modules/pose_graph/recorded_graph.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/rig_completion.hpp"
#include "runtime/dds/ros_network.hpp"
#include "runtime/supervisor.hpp"

namespace km {

/// Nothing: a run of the past, whose robot stands still and serves the others.
struct PastRun {};

/// What the robot perceives: a recording of sensors, or a recorded pose graph; and what it knows
/// from before.
struct RobotInput {
  std::variant<std::unique_ptr<DatasetReader>, RecordedGraph, PastRun> source;
  std::string name;  ///< For the journal.
  std::optional<RestoredRun> restored = {};
  std::optional<ContinuedMap> map = {};  ///< Of the restored run, where there is mapping.
  std::shared_ptr<const RosNetwork> ros = nullptr;  ///< Null unless it hears or tells something.
  CameraCalibration rig_correction = {};            ///< By which the sensors' rig came.
};

/// What --rig says of the sensors. A EuRoC folder has its own calibration, and takes a correction.
struct RigInput {
  std::optional<PartialRig> messages;  ///< Of messages.
  CameraCalibration correction;        ///< What the calibration is corrected by.
};

/// Throws ConfigError and DatasetError, see read_rig_file() and read_rig_correction().
[[nodiscard]] RigInput read_rig_input(const RobotOptions& options);

/// Opens what the options name, and with --resume the journal of the run to go on with. nullopt:
/// one of `signals` came while live topics were to complete the calibration. Throws DatasetError,
/// DdsError, InputFileError and std::invalid_argument with one line that names the file and what
/// helps.
[[nodiscard]] std::optional<RobotInput> open_robot_input(const RobotOptions& options,
                                                         const RobotConfig& config,
                                                         const std::optional<MappingPlan>& mapping,
                                                         const RigInput& rig, SignalWatch& signals);

}  // namespace km
