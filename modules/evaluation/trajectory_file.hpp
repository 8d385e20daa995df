#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "modules/core/stamped_pose.hpp"

namespace km {

/// A trajectory file that cannot be used. what() is one line that names file and line.
struct TrajectoryFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The trajectory file at `place`: the file itself, or, of a folder, its data.csv (EuRoC) or
/// groundtruth_tum.txt. nullopt if there is none.
[[nodiscard]] std::optional<std::filesystem::path> find_trajectory(
    const std::filesystem::path& place);

/// Poses of a trajectory file, or of the one that find_trajectory() finds in a folder, in order of
/// strictly increasing stamps. The form is told by the rows: with commas EuRoC's `t[ns], px, py,
/// pz, qw, qx, qy, qz, ...`, with blanks TUM's `t[s] px py pz qx qy qz qw`. Comments and one header
/// row are skipped. Throws TrajectoryFileError for a file that is missing or empty, and for a row
/// with too few fields, a field that is not a finite number, a quaternion whose norm is off by more
/// than 1 %, a coordinate beyond 1e9 m, a stamp beyond 146 years, or a stamp before the last. Of
/// rows with the same stamp, which published truths have, the first counts.
[[nodiscard]] std::vector<StampedPose> read_trajectory(const std::filesystem::path& file);

/// The same for the text of a file; `name` stands for it in messages.
[[nodiscard]] std::vector<StampedPose> parse_trajectory(std::string_view text,
                                                        const std::string& name);

}  // namespace km
