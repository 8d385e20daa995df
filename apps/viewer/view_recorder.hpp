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
#include "modules/ros_dds/closure_lines.hpp"
#include "modules/view/view_update.hpp"
#include "runtime/periodic.hpp"
#include "runtime/worker.hpp"

namespace km {

/// Writes what robots tell those who watch into one MCAP file: of each robot what its own record
/// has (see RosOutputNode) but for log lines, by the time of its sensors. What robots do not tell
/// is made of what they do: velocities of poses, and where the other end of a closure is, of
/// keyframes as they were optimised. It works on threads of its own: no page waits for a disk. A
/// viewer that is killed leaves what came up to a second before.
class ViewRecorder {
 public:
  /// With the first message `file` is replaced. `palette`: colours of meshes. Of a robot that has
  /// left, or been silent for `gone_s`, nothing more is written until it tells something.
  ViewRecorder(const std::filesystem::path& file, LabelPalette palette, double gone_s = 10.0);
  ~ViewRecorder();

  /// Thread-safe. Where the disk stands still for long, the oldest updates are left out.
  void add(const ViewUpdate& update) { worker_.post(update); }

  /// Ends the file: call once, nothing follows. Throws std::runtime_error if it is not whole, and
  /// says why.
  void finish();

 private:
  class File;
  class Sink;
  class Robot;
  using Input = std::optional<ViewUpdate>;  // nullopt: a second is over

  void step(const Input& update);
  Robot& robot_of(const ViewUpdate& update);
  void finish_robot(Robot& robot);
  [[nodiscard]] std::string name_of(RobotId robot) const;
  [[nodiscard]] std::vector<ToldClosure> closures_of(const Robot& robot) const;

  const LabelPalette palette_;
  const double gone_s_;
  const std::shared_ptr<File> file_;
  mutable std::mutex mutex_;  // guards names_
  std::map<RobotId, std::string> names_;
  std::map<RobotId, std::unique_ptr<Robot>> robots_;
  bool closures_changed_ = false;  // they, or the poses of their keyframes
  std::size_t lost_ = 0;           // messages for which there was no time
  Worker<Input> worker_;
  Periodic clock_;  // last member: stops first
};

}  // namespace km
