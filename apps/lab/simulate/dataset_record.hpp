#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace km {

/// Named values in the order they are shown.
using ParameterList = std::vector<std::pair<std::string, std::string>>;

/// Content of simulation.json in a folder of recordings: all parameters that its bytes depend on.
struct DatasetRecord {
  std::string generator;  ///< Program and version.
  ParameterList parameters;
  bool complete = false;  ///< Recordings, mesh and team file are all there.
};

/// Opens the output folder of a run: new, or begun by a run with the same parameters. Makes the
/// folder if it is missing. Returns its record, which is `wanted` for a new folder. Throws
/// std::runtime_error with a remedy if the folder has other content, was made with other
/// parameters, or cannot be written to.
[[nodiscard]] DatasetRecord open_dataset(const std::filesystem::path& folder,
                                         const DatasetRecord& wanted);

/// Writes simulation.json.
void write_record(const std::filesystem::path& folder, const DatasetRecord& record);

}  // namespace km
