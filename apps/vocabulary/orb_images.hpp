#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "modules/core/keyframe.hpp"

namespace km {

/// ORB descriptors of an image, at most `features`. Throws std::runtime_error that names the file
/// if it cannot be decoded.
std::vector<OrbDescriptor> orb_descriptors(const std::filesystem::path& image, int features);

/// Those of several images, in order, with progress on stderr.
std::vector<std::vector<OrbDescriptor>> orb_descriptors(
    std::span<const std::filesystem::path> images, int features);

}  // namespace km
