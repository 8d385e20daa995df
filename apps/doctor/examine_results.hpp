#pragma once

#include <filesystem>

#include "modules/diagnosis/examination.hpp"

namespace km {

/// True for the folder of a robot's results, and for a folder with the results of a team.
[[nodiscard]] bool are_results(const std::filesystem::path& folder);

/// Findings on the runs in `folder`, from summary.json, loop_closures.csv and config.yaml of each
/// robot. Ids: those of findings_of(), and `results.<file>` for a missing or invalid file. Throws
/// std::runtime_error for an unreadable summary.json.
[[nodiscard]] Examination examine_results(const std::filesystem::path& folder);

}  // namespace km
