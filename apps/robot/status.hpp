#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/robot/run_record.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "runtime/dds/bridge.hpp"
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

/// Status line of the robot:
///     7.4 s, 148 images, 21 keyframes | peers: bob alive | closures: own 3>2>2, bob 14>12>10
///     | pgo: cost 12.4, round 31, with 2 | map: 812 blocks, 53 k vertices, 101 k faces
///     | out: place 81.3 kB, verify 210.4 kB, pgo 5.0 kB, other 2.1 kB, waiting 12.1 kB | 143 MB
/// Closures are counted as candidates > verified > inliers for each robot, by the robot that found
/// them. Bytes that wait for the budget are shown if there are any. The last number is the resident
/// memory. kimera_multi_team reads the first number.
[[nodiscard]] std::string status_text(double dataset_time_s, const RunRecord& record,
                                      const std::vector<Peer>& peers,
                                      const TrafficSnapshot& traffic, std::uint64_t resident_bytes);

}  // namespace km
