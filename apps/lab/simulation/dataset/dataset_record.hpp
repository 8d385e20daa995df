#pragma once

#include <string>
#include <utility>
#include <vector>

namespace km {

/// Named values in the order they are shown.
using ParameterList = std::vector<std::pair<std::string, std::string>>;

/// Content of simulation.json in a folder of recordings: all parameters that its bytes depend on,
/// and the finished robots. It is the same for two runs of one command.
struct DatasetRecord {
  std::string generator;  ///< Program and version.
  ParameterList parameters;
  std::vector<std::string> finished_robots;
  bool complete = false;  ///< Recordings, mesh, team file and README are all there.
};

[[nodiscard]] std::string to_json(const DatasetRecord& record);

/// Reasons why a run with `wanted` cannot continue in a folder made with `found`, one line per
/// difference: "duration: 30 there, 60 asked for". Empty if it can.
[[nodiscard]] std::vector<std::string> differences(const DatasetRecord& found,
                                                   const DatasetRecord& wanted);

}  // namespace km
