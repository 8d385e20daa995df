#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "modules/core/data/stamped_pose.hpp"

namespace km {

/// The trajectory file at `place`: the file itself, or data.csv (EuRoC) or groundtruth_tum.txt in a
/// folder or among the true poses of a recording in EuRoC's layout. nullopt if there is none.
[[nodiscard]] std::optional<std::filesystem::path> find_trajectory(
    const std::filesystem::path& place);

/// Poses of a trajectory file, or of the file from find_trajectory() in a folder, with strictly
/// increasing stamps. A header (OKVIS2, Basalt, MCD, ...) names the columns of stamp and pose and
/// the order of the quaternion. Without names the rows determine the format: EuRoC's `t[ns], px,
/// py, pz, qw, qx, qy, qz, ...` has commas, TUM's `t[s] px py pz qx qy qz qw` has blanks. The size
/// of TUM's stamps shows whether they are s, ms, us or ns (ORB-SLAM3). KITTI's rows of 12
/// numbers have their stamps in times.txt, beside the file or in ../sequences/NAME. Comments are
/// skipped. Published truths contain rows with equal stamps, of which the first counts.
///
/// Throws InputFileError for a file that is missing or empty, and for a row with one of these
/// faults:
/// - too few fields, or a field that is not a finite number;
/// - a quaternion whose norm errs by more than 1 %;
/// - a coordinate beyond 1e9 m;
/// - a stamp beyond 146 years, or before the last one; more than 5000 poses a second.
[[nodiscard]] std::vector<StampedPose> read_trajectory(const std::filesystem::path& file);

/// A file as read_trajectory() reads it, with the covariances of rows of TUM's format that also
/// have the 36 numbers of geometry_msgs/PoseWithCovariance. Throws InputFileError also for a row
/// without them. With `skip` a row needs none, a faulty row is left out after skip("FILE line N:
/// FAULT"), and stamps are in any order.
[[nodiscard]] UncertainTrajectory read_uncertain_trajectory(
    const std::filesystem::path& file,
    const std::function<void(const std::string&)>& skip = nullptr);

/// Parses the text of a file; `name` replaces the file name in messages.
[[nodiscard]] std::vector<StampedPose> parse_trajectory(std::string_view text,
                                                        const std::string& name);

}  // namespace km
