#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "runtime/node.hpp"

namespace km {

/// What a robot says of itself on /diagnostics.

/// What the sensors gave: a warning if frames were skipped, or anything was faulty.
[[nodiscard]] RosDiagnosticStatus sensors_status(std::size_t published, std::size_t skipped,
                                                 const ReaderReport& faults);

/// How busy the modules' threads are. Not thread-safe.
class ModuleLoads {
 public:
  /// The nodes outlive it.
  explicit ModuleLoads(std::vector<const Node*> nodes);

  /// By name, the share of the time since the last call that each spent in its steps.
  [[nodiscard]] std::vector<std::pair<std::string, double>> shares();

  /// These; a warning where one hardly rests.
  [[nodiscard]] RosDiagnosticStatus status();

 private:
  std::vector<const Node*> nodes_;
  std::map<const Node*, double> spent_s_;
  double asked_s_;
};

}  // namespace km
