#pragma once

#include <filesystem>
#include <string>

namespace km {

/// What is in a recording, for people: a bag of ROS 1 or 2, an MCAP file, or a EuRoC folder. A
/// table of its topics with how regularly they come, one of the pairs of cameras with how well
/// their stamps agree, and what was skipped. Throws InputFileError, a line with file and place, for
/// what is none.
[[nodiscard]] std::string inspect_recording(const std::filesystem::path& path);

/// Likewise, of a bag, and writes `rig`, a rig file (see RigFile) with the topics that are most
/// likely its sensors. Throws InputFileError if `rig` is there already, too, and what write_file()
/// throws.
[[nodiscard]] std::string inspect_recording(const std::filesystem::path& path,
                                            const std::filesystem::path& rig);

}  // namespace km
