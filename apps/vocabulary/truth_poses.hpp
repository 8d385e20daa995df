#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/stamped_pose.hpp"

namespace km {

/// Poses of a ground truth file, ascending: EuRoC CSV (`t[ns], p, q w x y z, ...`) or TUM text
/// (`t[s] p q x y z w`). Throws std::runtime_error that names file and line.
std::vector<StampedPose> read_truth(const std::filesystem::path& file);

/// The pose nearest to `stamp`, or nullopt if none is within `tolerance_s`.
std::optional<SE3> pose_at(std::span<const StampedPose> poses, Stamp stamp, double tolerance_s);

/// The stamp in an image's name: its leading digits [ns]. Throws std::runtime_error if it has none.
Stamp stamp_of_image(const std::filesystem::path& image);

}  // namespace km
