#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace km {

/// The images that `inputs` stand for, in order, every `stride`-th of each input. An input is
///   - an image file;
///   - a EuRoC/ASL folder (with mav0/cam0/data.csv, or mav0 itself): its left images;
///   - any other folder: its .png, .jpg and .jpeg files by name, sub-folders not included;
///   - a text file (.txt, .csv): one image per line, its last field, relative to the text file.
/// Throws std::runtime_error that names what does not exist or holds no image.
std::vector<std::filesystem::path> list_images(const std::vector<std::string>& inputs, int stride);

}  // namespace km
