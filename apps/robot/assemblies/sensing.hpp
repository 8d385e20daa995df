#pragma once

#include <atomic>
#include <cstddef>

#include "apps/robot/assemblies/robot_core.hpp"
#include "apps/robot/journal_node.hpp"
#include "modules/sensors/node/sensors_node.hpp"
#include "modules/vio/node/vio_node.hpp"

namespace km {

/// From the input to new keyframes: images and odometry, a recorded graph, or a former run.
class Sensing {
 public:
  /// Takes the source from `input`.
  Sensing(RobotCore& core, const RobotConfig& config, const PlaybackPace& pace, RobotInput& input);

  /// Publishes the former run, if there is one, as the nodes start. Call when all are connected.
  void restore_past();

  [[nodiscard]] const SensorsNode* sensors() const { return sensors_; }  ///< Null without sensors.
  /// Number of images with a pose from an earlier process.
  [[nodiscard]] std::size_t restored_images() const { return restored_images_; }
  /// True once the source has ended. Thread-safe.
  [[nodiscard]] bool source_ended() const { return source_ended_; }

 private:
  void add_sensors(const RobotConfig& config, const PlaybackPace& pace,
                   std::unique_ptr<DatasetReader> reader);
  void add_odometry(VioNode::Odometry odometry);
  void add_features(const RobotConfig& config, const StereoRig& rig);
  void add_playback(const RobotConfig& config, double rate, RecordedGraph graph);
  void add_restore();

  RobotCore& core_;
  SensorsNode* sensors_ = nullptr;
  RestoreNode* restore_ = nullptr;
  std::size_t restored_images_ = 0;
  std::atomic<bool> source_ended_ = false;
};

}  // namespace km
