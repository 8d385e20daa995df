#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/label_palette.hpp"
#include "modules/ros_dds/drawings.hpp"
#include "modules/view/view_update.hpp"
#include "runtime/periodic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Writes the messages of the robots for viewers into one MCAP file. For each robot the file has
/// the topics of the robot's own record (see RosOutputNode) except for log lines. Stamps are those
/// of the sensors of the robot. Values that robots do not send are computed: velocities from poses,
/// and the far ends of closures from optimised keyframes. The recorder has threads of its own, so
/// that no page waits for a disk. If the viewer is killed, the file lacks the last second.
class ViewRecorder {
 public:
  /// The first message replaces `file`. `palette`: colours of meshes. After a robot has left, or
  /// been silent for `gone_s`, nothing is written for it until it sends a message.
  ViewRecorder(const std::filesystem::path& file, LabelPalette palette, double gone_s = 10.0);
  ~ViewRecorder();

  /// Thread-safe. If the disk stalls for long, the oldest updates are left out.
  void add(const ViewUpdate& update) { worker_.post(update); }

  /// Ends the file: call once, after the last update. Throws std::runtime_error with the reason if
  /// the file is incomplete.
  void finish();

 private:
  struct File;
  class Sink;
  class Robot;
  using Input = std::optional<ViewUpdate>;  // nullopt: a second has passed

  void step(const Input& update);
  Robot& robot_of(const ViewUpdate& update);
  void finish_robot(Robot& robot);
  [[nodiscard]] std::string name_of(RobotId robot) const;
  [[nodiscard]] std::vector<PublishedClosure> closures_of(const Robot& robot) const;

  const LabelPalette palette_;
  const double gone_s_;
  const std::shared_ptr<File> file_;
  mutable std::mutex mutex_;  // guards names_
  std::map<RobotId, std::string> names_;
  std::map<RobotId, std::unique_ptr<Robot>> robots_;
  bool closures_changed_ = false;    // true if closures or the poses of their keyframes changed
  std::size_t missing_updates_ = 0;  // number of updates that the record lacks
  Worker<Input> worker_;
  Periodic clock_;  // last member: stops first
};

}  // namespace km
