#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace km {

/// Records in the folder of a robot, in order; empty if there is none.
[[nodiscard]] std::vector<std::filesystem::path> robot_records(const std::filesystem::path& folder);

/// Merges records into one file by time. Topics of equal name and type become one. Attached files
/// are named after the robots' folders, "alice/keyframes.csv". If `root` names a robot, its map
/// frame is that of the team: /tf_static publishes it as `map`. Throws InputFileError for an
/// unreadable record, and std::runtime_error if `file` cannot be written.
void merge_records(std::span<const std::filesystem::path> records, const std::string& root,
                   const std::filesystem::path& file);

}  // namespace km
