#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/output_file.hpp"
#include "apps/program_options.hpp"
#include "modules/core/data/keyframe.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/images/keypoint_extractor.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/place_recognition/vocabulary_training.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAbout =
    R"(Vocabularies of visual words: what place recognition compares images by.
All robots of a team need the same vocabulary file.

IMAGES are image files, folders of .png or .jpg, EuRoC/ASL folders (their left camera), or
text files that list one image per line. Examples:
  kimera_multi_vocabulary train -o site.kmvoc -k 10 -L 4 recording_1 recording_2)";

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

// The images of `inputs` in order, every `stride`-th of each input. An input is
//   - an image file;
//   - a EuRoC/ASL folder (with mav0/cam0/data.csv, or mav0 itself): its left images;
//   - any other folder: its .png, .jpg and .jpeg files by name, sub-folders not included;
//   - a text file (.txt, .csv): one image per line, its last field, relative to the text file.
// Throws std::runtime_error that names an input which does not exist or has no image.
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

// Descriptors of an image by make_keypoint_extractor(), at most `features`. Throws
// std::runtime_error that names the file if it cannot be decoded.
std::vector<BinaryDescriptor> image_descriptors(const fs::path& image, int features) {
  const cv::Mat grey = read_pixels(image, DecodedPixels::kGray);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  make_keypoint_extractor(features)->detectAndCompute(grey, cv::noArray(), keypoints, descriptors);
  return descriptors_of_rows(descriptors);
}

// Descriptors of several images, in order, with progress on stderr.
std::vector<std::vector<BinaryDescriptor>> image_descriptors(std::span<const fs::path> images,
                                                             int features) {
  std::vector<std::vector<BinaryDescriptor>> result;
  for (const auto& image : images) {
    result.push_back(image_descriptors(image, features));
    if (result.size() % 50 == 0 || result.size() == images.size())
      std::cerr << "descriptors: " << result.size() << " of " << images.size() << " images\n";
  }
  return result;
}

struct TrainCommand {
  std::vector<std::string> images;
  std::string vocabulary;  // The file to write.
  std::string json;        // Results for programs; none if empty.
  int features = 1000;     // ORB features per image.
  int branching = 10;
  int depth = 5;
  std::uint32_t seed = 1;
  int every = 1;
};

void define(CLI::App& app, TrainCommand& command) {
  app.add_option("images", command.images, "IMAGES to learn from, as varied as the places to come")
      ->required();
  app.add_option("-o,--output", command.vocabulary, "Vocabulary file to write")->required();
  app.add_option("-k,--branching", command.branching, "Children of a node of the tree")
      ->capture_default_str();
  app.add_option("-L,--depth", command.depth,
                 "Levels of the tree: at most k^L words, about 37 bytes each")
      ->capture_default_str();
  app.add_option("--seed", command.seed, "Seed of the random start of clustering")
      ->capture_default_str();
  app.add_option("--every", command.every, "Use every N-th image of an input")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--features", command.features, "ORB features per image")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--json", command.json, "Also write the results to this file, as JSON");
}

void run(const TrainCommand& command) {
  check_output_folder(command.vocabulary);
  check_output_folder(command.json);
  const VocabularyTrainingConfig config = checked(VocabularyTrainingConfig{
      .branching = command.branching, .depth = command.depth, .seed = command.seed});
  const auto images = list_images(command.images, command.every);
  const auto descriptors = image_descriptors(images, command.features);
  const VocabularyData data = train_vocabulary(descriptors, config, [&](int levels) {
    std::cerr << "training: level " << levels << " of " << config.depth << '\n';
  });
  save_vocabulary(data, command.vocabulary);

  std::size_t total = 0;
  for (const auto& image : descriptors) total += image.size();
  const std::string id = fingerprint_text(fingerprint(data));
  const auto bytes = std::filesystem::file_size(command.vocabulary);
  std::cout << command.vocabulary << ": " << data.idf.size() << " words, " << data.children.size()
            << " nodes, " << bytes << " bytes, id " << id << "\nfrom " << total
            << " descriptors of " << images.size() << " images\n";
  write_output(command.json, [&](std::ostream& out) {
    out << nlohmann::ordered_json{{"words", data.idf.size()}, {"nodes", data.children.size()},
                                  {"bytes", bytes},           {"id", id},
                                  {"descriptors", total},     {"images", images.size()}}
        << '\n';
  });
}

void add_train(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("train", "Learn a vocabulary from images");
  const auto command = std::make_shared<TrainCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace
}  // namespace km

int main(int argc, char** argv) {
  return km::run_subcommands("kimera_multi_vocabulary", km::kAbout, {km::add_train}, argc, argv);
}
