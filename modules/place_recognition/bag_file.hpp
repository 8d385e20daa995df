#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/place_recognition/bag_of_words.hpp"

namespace km {

// Format: text, one image per line: "word:count word:count ...", words ascending. An empty line is
// an image without words.

/// The text of the bags of a sequence of images.
[[nodiscard]] std::string bags_text(const std::vector<BagOfWords>& bags);

/// Inverse of bags_text(). Throws std::runtime_error that names the file and the line if the file
/// cannot be read, or if a line is no bag (words not ascending, count zero, other text).
[[nodiscard]] std::vector<BagOfWords> read_bags(const std::filesystem::path& file);

}  // namespace km
