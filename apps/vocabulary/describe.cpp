#include <chrono>
#include <iostream>
#include <memory>
#include <opencv2/core.hpp>

#include "apps/output_file.hpp"
#include "apps/vocabulary/commands.hpp"
#include "apps/vocabulary/images.hpp"
#include "modules/core/text_table.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/place_recognition/image_describer.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {
namespace {

struct DescribeCommand : VocabularyCommand {
  std::string network;
  std::vector<std::string> images;
  std::string output;
};

void define(CLI::App& app, DescribeCommand& command) {
  app.add_option("network", command.network, "ONNX file")->required();
  app.add_option("images", command.images, "IMAGES, in the order of the descriptors")->required();
  app.add_option("-o,--output", command.output,
                 "File of the descriptors, one line of numbers per image")
      ->required();
  app.add_option("--every", command.every, "Use every N-th image of an input")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
}

std::string text_of(const ImageDescriptor& descriptor) {
  std::string text;
  for (const int value : descriptor.values)
    text += (text.empty() ? "" : " ") + std::to_string(value);
  return text + '\n';
}

void run(const DescribeCommand& command) {
  check_output_folder(command.output);
  cv::setNumThreads(1);
  ImageDescriber describer(command.network);
  const auto images = list_images(command.images, command.every);
  std::string text;
  std::chrono::duration<double, std::milli> spent{};
  for (const auto& file : images) {
    const cv::Mat grey = read_pixels(file, DecodedPixels::kGray);
    const GrayImage image{
        grey.cols, grey.rows, {grey.begin<std::uint8_t>(), grey.end<std::uint8_t>()}};
    const auto start = std::chrono::steady_clock::now();
    const ImageDescriptor descriptor = describer.describe(image);
    spent += std::chrono::steady_clock::now() - start;
    text += text_of(descriptor);
  }
  write_output(command.output, [&](std::ostream& out) { out << text; });
  std::cout << images.size() << " descriptors by network " << fingerprint_text(describer.network())
            << ", " << fixed(spent.count() / static_cast<double>(images.size()), 2)
            << " ms each on one core\n";
}

}  // namespace

void add_describe(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "describe", "Write the descriptors of images by a network to a file, for apps/lab/places");
  const auto command = std::make_shared<DescribeCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
