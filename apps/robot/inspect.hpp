#pragma once

#include <filesystem>
#include <string>

namespace km {

/// What is in a recording, for people: a bag of ROS 1 or 2, an MCAP file, or a EuRoC folder. A
/// table of its topics with how regularly they come, one of the pairs of cameras with how well
/// their stamps agree, and what was skipped. Throws InputFileError, a line with file and place, for
/// what is none.
[[nodiscard]] std::string inspect_recording(const std::filesystem::path& path);

}  // namespace km
