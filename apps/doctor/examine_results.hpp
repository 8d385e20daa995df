#pragma once

#include <filesystem>

#include "modules/diagnosis/examination.hpp"

namespace km {

/// True for a folder with the summary.json of a robot, or for the folder above those of a team.
[[nodiscard]] bool are_results(const std::filesystem::path& folder);

/// Findings on the runs in `folder`, from summary.json, loop_closures.csv and config.yaml of each
/// robot. Ids: see findings_of(); results.<file> for a file that is missing or broken. Throws
/// std::runtime_error for an unreadable summary.json.
[[nodiscard]] Examination examine_results(const std::filesystem::path& folder);

}  // namespace km
