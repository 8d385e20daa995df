#include <iostream>
#include <memory>
#include <stdexcept>

#include "apps/output_file.hpp"
#include "apps/vocabulary/commands.hpp"
#include "apps/vocabulary/images.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/images/keypoint_patches.hpp"
#include "modules/images/spread_keypoints.hpp"
#include "modules/loop_closure/keyframe_features_config.hpp"

namespace km {
namespace {

struct PatchesCommand : VocabularyCommand {
  std::vector<std::string> images;
  std::string output;
};

void define(CLI::App& app, PatchesCommand& command) {
  app.add_option(
         "images", command.images,
         "IMAGES: files, folders of .png or .jpg, EuRoC/ASL folders, or text files with one "
         "image per line")
      ->required();
  app.add_option("-o,--output", command.output, "File of the patches (NumPy's .npy)")->required();
  command.define_images(app);
}

// Header of NumPy's format for an array of `count` records: magic, version 1.0, length of the text.
std::string npy_header(std::size_t count) {
  std::string text =
      "{'descr': [('image', '<u4'), ('x', '<f4'), ('y', '<f4'), ('octave', '<u4'), "
      "('orb', 'u1', (" +
      std::to_string(kDescriptorBytes) + ",)), ('patch', 'u1', (" + std::to_string(kPatchSide) +
      ", " + std::to_string(kPatchSide) + "))], 'fortran_order': False, 'shape': (" +
      std::to_string(count) + ",), }";
  constexpr std::size_t kPrefix = 10, kAlignment = 64;
  text.append(kAlignment - (kPrefix + text.size() + 1) % kAlignment, ' ');
  text += '\n';
  const auto length = static_cast<std::uint16_t>(text.size());
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(length & 0xFFU) +
         static_cast<char>(length >> 8U) + text;
}

void append(std::string& bytes, const auto& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// One record for each keypoint of the image.
std::string records_of(const std::filesystem::path& file, std::uint32_t number, int features) {
  const cv::Mat image = read_pixels(file, DecodedPixels::kGray);
  const SpreadKeypoints keypoints =
      spread_keypoints(image, features, KeyframeFeaturesConfig().min_contrast);
  const cv::Mat patches = keypoint_patches(image, keypoints.corners);
  std::string bytes;
  for (std::size_t i = 0; i < keypoints.corners.size(); ++i) {
    const cv::KeyPoint& corner = keypoints.corners[i];
    append(bytes, number);
    append(bytes, corner.pt.x);
    append(bytes, corner.pt.y);
    append(bytes, static_cast<std::uint32_t>(corner.octave));
    append(bytes, keypoints.descriptors[i]);
    bytes.append(patches.ptr<char>(static_cast<int>(i)), static_cast<std::size_t>(patches.cols));
  }
  return bytes;
}

void run(const PatchesCommand& command) {
  check_output_folder(command.output);
  const auto images = list_images(command.images, command.every);
  std::string records;
  for (std::uint32_t i = 0; i < images.size(); ++i) {
    records += records_of(images[i], i, command.features);
    constexpr std::uint32_t kReported = 50;
    if ((i + 1) % kReported == 0 || i + 1 == images.size())
      std::cerr << "patches: " << i + 1 << " of " << images.size() << " images\n";
  }
  constexpr std::size_t kRecord = 16 + kDescriptorBytes + kPatchSide * kPatchSide;
  const std::size_t count = records.size() / kRecord;
  if (count == 0)
    throw std::runtime_error("no image has a keypoint: they are black, blurred or too small");
  write_output(command.output, [&](std::ostream& out) { out << npy_header(count) << records; });
  std::cout << count << " patches of " << images.size() << " images\n";
}

}  // namespace

void add_patches(CLI::App& parent) {
  CLI::App& app =
      *parent.add_subcommand("patches",
                             R"(Write the surroundings of keypoints to a file, for apps/lab/places.
Each record has image (its number), x, y [px], octave, orb (descriptor) and patch.
Example: kimera_multi_vocabulary patches recording_1/mav0/cam0/data -o patches.npy)");
  const auto command = std::make_shared<PatchesCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
