#pragma once

#include <filesystem>

#include "modules/diagnosis/examination.hpp"

namespace km {

/// True for the folder that a robot left its summary.json in, or one above those of a team.
[[nodiscard]] bool are_results(const std::filesystem::path& folder);

/// What stands out of the runs in `folder`, from summary.json, loop_closures.csv and config.yaml of
/// each robot. Ids: see findings_of(); results.<file> for a file that is missing or broken. Throws
/// std::runtime_error for a summary.json that cannot be read.
[[nodiscard]] Examination examine_results(const std::filesystem::path& folder);

}  // namespace km
