#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "apps/robot/assemblies/back_end.hpp"
#include "apps/robot/assemblies/mapping.hpp"
#include "apps/robot/assemblies/progress.hpp"
#include "apps/robot/assemblies/sensing.hpp"
#include "apps/robot/run_record.hpp"
#include "apps/robot/status.hpp"
#include "modules/ros_dds/node/ros_output_node.hpp"
#include "modules/view/node/view_node.hpp"

namespace km {

/// Readers of what the other assemblies publish: recorder, status, viewers, topics of ROS, and the
/// record in MCAP.
class Records {
 public:
  struct Sources {
    JournalNode& journal;
    const Sensing& sensing;
    const Places& places;
    const BackEnd& back_end;
    const Mapping& mapping;
  };

  Records(RobotCore& core, const Sources& sources);

  /// Viewers see the images of `camera`, if there is one.
  void add_view(const ViewConfig& config, const std::optional<Camera>& camera);
  void add_ros(std::shared_ptr<const RosNetwork> network);
  /// `results` outlives this.
  void add_record(const RobotOptions& options, ResultWriter& results);
  /// Call when all nodes are added.
  void measure_loads() { loads_.emplace(core_.nodes.all()); }

  [[nodiscard]] const RecorderNode& recorder() const { return *recorder_; }
  /// Later messages are not recorded.
  void freeze() { recorder_->freeze(); }
  [[nodiscard]] const RobotStatusNode& statuses() const { return *status_; }
  [[nodiscard]] Progress& progress() { return progress_; }
  [[nodiscard]] const Progress& progress() const { return progress_; }
  /// Null without --record.
  [[nodiscard]] RosOutputNode* record() const { return record_; }
  /// Bytes sent since the start, by category.
  [[nodiscard]] std::map<std::string, std::uint64_t> sent_bytes() const;
  /// Publishes the present state of the robot. Only one thread calls this.
  void publish_sample();

 private:
  RosOutputNode& add_output(std::string_view node, std::unique_ptr<RosSink> sink,
                            RosOutputOptions options, std::optional<In<SensorPacket>> images);
  void publish(const JournalEntry& event);
  [[nodiscard]] std::string name_of(RobotId robot) const;

  RobotCore& core_;
  const Sources sources_;
  Progress progress_;
  RecorderNode* recorder_ = nullptr;
  RobotStatusNode* status_ = nullptr;
  ViewNode* view_ = nullptr;
  RosOutputNode* record_ = nullptr;
  std::optional<ModuleLoads> loads_;
};

}  // namespace km
