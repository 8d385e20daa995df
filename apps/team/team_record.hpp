#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace km {

/// The records that a robot left in its folder, in order; empty if there is none.
[[nodiscard]] std::vector<std::filesystem::path> robot_records(const std::filesystem::path& folder);

/// Puts records into one file by time. Topics of equal name and type become one; files in them are
/// named after the robots' folders, "alice/keyframes.csv". Where `root` names
/// a robot, its map frame is that of the team: /tf_static tells that it is `map`. Throws
/// InputFileError for a record that cannot be read, and std::runtime_error for what keeps `file`
/// from being written.
void merge_records(std::span<const std::filesystem::path> records, const std::string& root,
                   const std::filesystem::path& file);

}  // namespace km
