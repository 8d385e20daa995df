#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "runtime/node.hpp"

namespace km {

/// Status of the sensors: a warning if frames were skipped or a fault occurred.
[[nodiscard]] RosDiagnosticStatus sensors_status(std::size_t published, std::size_t skipped,
                                                 const ReaderReport& faults);

/// Status of the pose graph optimisation: a warning if the relative place of a member is uncertain.
[[nodiscard]] RosDiagnosticStatus team_status(const OptimizerProgress& progress);

/// Load of the modules' threads. Not thread-safe.
class ModuleLoads {
 public:
  /// The nodes outlive this.
  explicit ModuleLoads(std::vector<const Node*> nodes);

  /// By node name, the share of the time since the last call that the node spent in its steps.
  [[nodiscard]] std::vector<std::pair<std::string, double>> shares();

  /// Status with these shares; a warning if a node is busy nearly all the time.
  [[nodiscard]] RosDiagnosticStatus status();

 private:
  std::vector<const Node*> nodes_;
  std::map<const Node*, double> spent_s_;
  double asked_s_;
};

}  // namespace km
