#pragma once

#include <string>
#include <utility>
#include <vector>

namespace km {

/// Named values in the order they are shown.
using ParameterList = std::vector<std::pair<std::string, std::string>>;

/// What simulation.json says of a folder of recordings: everything that its bytes depend on, and
/// which robots are finished. Holds nothing that differs between two runs of one command.
struct DatasetRecord {
  std::string generator;  ///< Program and version.
  ParameterList parameters;
  std::vector<std::string> finished_robots;
  bool complete = false;  ///< Recordings, mesh, team file and README are all there.
};

[[nodiscard]] std::string to_json(const DatasetRecord& record);

/// What keeps a run that wants `wanted` from going on in a folder made with `found`, one line per
/// difference: "duration: 30 there, 60 asked for". Empty if nothing does.
[[nodiscard]] std::vector<std::string> differences(const DatasetRecord& found,
                                                   const DatasetRecord& wanted);

}  // namespace km
