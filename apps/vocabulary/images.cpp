#include "apps/vocabulary/images.hpp"

#include <algorithm>
#include <cctype>
#include <iostream>
#include <stdexcept>

#include "modules/core/input_file.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/images/keypoint_extractor.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

bool has_extension(const fs::path& path, std::initializer_list<const char*> extensions) {
  std::string own = path.extension().string();
  for (char& c : own) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::find(extensions.begin(), extensions.end(), own) != extensions.end();
}

bool is_image(const fs::path& path) {
  return has_extension(path, {".png", ".jpg", ".jpeg"});
}

std::vector<fs::path> listed_in(const fs::path& list, const fs::path& folder) {
  const std::string text = read_input_file(list);
  std::vector<fs::path> images;
  for (const TextRow& row : split_rows(text)) images.push_back(folder / row.fields.back());
  return images;
}

std::vector<fs::path> images_in(const fs::path& folder) {
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder))
    if (is_file(entry.path()) && is_image(entry.path())) images.push_back(entry.path());
  std::sort(images.begin(), images.end());
  return images;
}

std::vector<fs::path> expand(const fs::path& input) {
  if (!is_there(input)) throw std::runtime_error(input.string() + " does not exist");
  if (is_folder(input)) {
    for (const fs::path& camera : {input / "mav0" / "cam0", input / "cam0"})
      if (is_there(camera / "data.csv")) return listed_in(camera / "data.csv", camera / "data");
    return images_in(input);
  }
  if (has_extension(input, {".txt", ".csv"})) return listed_in(input, input.parent_path());
  return {input};
}

}  // namespace

std::vector<fs::path> list_images(const std::vector<std::string>& inputs, int stride) {
  std::vector<fs::path> images;
  // Image files given one by one (by a shell's pattern) count as one input.
  std::size_t single_files = 0;
  for (const std::string& input : inputs) {
    const std::vector<fs::path> expanded = expand(input);
    if (expanded.empty()) throw std::runtime_error(input + " holds no image (.png, .jpg, .jpeg)");
    const bool is_single = expanded.size() == 1 && is_image(input);
    const std::size_t first = is_single ? single_files++ : 0;
    for (std::size_t i = 0; i < expanded.size(); ++i)
      if ((first + i) % static_cast<std::size_t>(stride) == 0) images.push_back(expanded[i]);
  }
  for (const fs::path& image : images)
    if (!is_file(image)) throw std::runtime_error(image.string() + " does not exist or is no file");
  return images;
}

std::vector<BinaryDescriptor> image_descriptors(const std::filesystem::path& image, int features) {
  const cv::Mat grey = read_pixels(image, DecodedPixels::kGray);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  make_keypoint_extractor(features)->detectAndCompute(grey, cv::noArray(), keypoints, descriptors);
  return descriptors_of_rows(descriptors);
}

std::vector<std::vector<BinaryDescriptor>> image_descriptors(
    std::span<const std::filesystem::path> images, int features) {
  std::vector<std::vector<BinaryDescriptor>> result;
  for (const auto& image : images) {
    result.push_back(image_descriptors(image, features));
    if (result.size() % 50 == 0 || result.size() == images.size())
      std::cerr << "descriptors: " << result.size() << " of " << images.size() << " images\n";
  }
  return result;
}

}  // namespace km
