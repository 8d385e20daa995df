#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "modules/core/keyframe.hpp"

namespace km {

/// The images of `inputs` in order, every `stride`-th of each input. An input is
///   - an image file;
///   - a EuRoC/ASL folder (with mav0/cam0/data.csv, or mav0 itself): its left images;
///   - any other folder: its .png, .jpg and .jpeg files by name, sub-folders not included;
///   - a text file (.txt, .csv): one image per line, its last field, relative to the text file.
/// Throws std::runtime_error that names an input which does not exist or has no image.
std::vector<std::filesystem::path> list_images(const std::vector<std::string>& inputs, int stride);

/// Descriptors of an image by make_keypoint_extractor(), at most `features`. Throws
/// std::runtime_error that names the file if it cannot be decoded.
std::vector<BinaryDescriptor> image_descriptors(const std::filesystem::path& image, int features);

/// Descriptors of several images, in order, with progress on stderr.
std::vector<std::vector<BinaryDescriptor>> image_descriptors(
    std::span<const std::filesystem::path> images, int features);

}  // namespace km
