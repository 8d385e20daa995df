#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "apps/robot/assemblies/records.hpp"

namespace km {

/// One robot: a list of assemblies on one core. Which topics connect them is in topics.hpp.
class Robot {
 public:
  /// Builds and connects all nodes; none runs yet. Without `mapping` there is no map. `results`,
  /// which outlives this, receives the meshes. Throws ConfigError and DdsError.
  Robot(const RobotOptions& options, const RobotConfig& config, RobotInput input,
        const std::optional<MappingPlan>& mapping, ResultWriter& results, SignalWatch& signals);

  /// Runs until the robot may leave its team, a node fails, or a signal arrives. The results folder
  /// must exist.
  [[nodiscard]] RunResult run(const Supervisor::Finished& finished);

  /// True once the input has ended and the recorder has processed all messages that follow from it:
  /// no more keyframes come. Does not wait.
  bool input_ended();

  /// Stops recording; the mesh is then corrected with the present trajectory.
  void freeze_record();

  /// Takes the robot off the network, as its destructor does. For a robot that cannot be destroyed,
  /// call after run() and end the process.
  void leave();

  [[nodiscard]] DdsBridge& bridge() { return *core_.bridge; }
  [[nodiscard]] const NetworkInterface& interface() const { return core_.participant.interface(); }
  [[nodiscard]] const std::vector<const Node*>& nodes() const { return nodes_.all(); }
  /// For tests: messages that the nodes publish.
  [[nodiscard]] Topics& topics() { return core_.topics; }

  [[nodiscard]] const Sensing& sensing() const { return *sensing_; }
  [[nodiscard]] const Places& places() const { return *places_; }
  [[nodiscard]] BackEnd& back_end() { return *back_end_; }
  [[nodiscard]] const BackEnd& back_end() const { return *back_end_; }
  [[nodiscard]] const Mapping& mapping() const { return *mapping_; }
  [[nodiscard]] Records& records() { return *records_; }
  [[nodiscard]] const Records& records() const { return *records_; }

 private:
  RobotCore core_;
  std::unique_ptr<Sensing> sensing_;
  std::unique_ptr<Places> places_;
  std::unique_ptr<BackEnd> back_end_;
  std::unique_ptr<Mapping> mapping_;
  std::unique_ptr<Records> records_;
  JournalNode* journal_ = nullptr;
  NodeList nodes_;  // last: its nodes stop before the objects that they use are destroyed
};

}  // namespace km
