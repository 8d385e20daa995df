#include <catch2/catch.hpp>
#include <cmath>

#include "modules/core/config.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/place_recognition/descriptor_database.hpp"
#include "modules/place_recognition/image_describer.hpp"
#include "test/support/onnx_model.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

constexpr const char* kShipped = "config/networks/places.onnx";

// Gives the image itself: its pixels at mean 0 and deviation 1, times `weight`.
PointwiseNetwork copying(int channels = 1, float weight = 1.0F) {
  PointwiseNetwork network{.channels = channels, .height = 8, .width = 16};
  network.weights = {std::vector<float>(static_cast<std::size_t>(channels), weight)};
  network.biases = {0.0F};
  return network;
}

ImageDescriber describer_of(const TemporaryFolder& folder, const PointwiseNetwork& network) {
  return ImageDescriber(folder.write("net.onnx", network.onnx()));
}

// Grey levels `low` in the left half and `high` in the right one.
GrayImage halves(int width, int height, std::uint8_t low, std::uint8_t high) {
  GrayImage image{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.pixels.push_back(x < width / 2 ? low : high);
  return image;
}

GrayImage load(const std::filesystem::path& file) {
  const cv::Mat grey = read_pixels(file, DecodedPixels::kGray);
  return {grey.cols, grey.rows, {grey.begin<std::uint8_t>(), grey.end<std::uint8_t>()}};
}

GrayImage darker(GrayImage image) {
  for (std::uint8_t& pixel : image.pixels) pixel = static_cast<std::uint8_t>(pixel / 2 + 5);
  return image;
}

TEST_CASE("A descriptor is the output for the image at mean 0 and deviation 1, in bytes",
          "[image_describer]") {
  const TemporaryFolder folder;
  const int channels = GENERATE(1, 3);
  const float weight = GENERATE(0.01F, 50.0F);  // only the direction counts
  ImageDescriber describer = describer_of(folder, copying(channels, weight));
  const ImageDescriptor found = describer.describe(halves(160, 40, 30, 90));
  CHECK(found.network == describer.network());
  REQUIRE(found.values.size() == 128);
  for (std::size_t i = 0; i < 128; ++i) CHECK(int{found.values[i]} == (i % 16 < 8 ? -127 : 127));
}

TEST_CASE("Brightness and contrast do not change a descriptor", "[image_describer]") {
  const TemporaryFolder folder;
  ImageDescriber describer = describer_of(folder, copying());
  CHECK(describer.describe(halves(16, 8, 100, 102)).values ==
        describer.describe(halves(16, 8, 0, 255)).values);
}

TEST_CASE("An image of one grey level and an output of zeros have no descriptor",
          "[image_describer]") {
  const TemporaryFolder folder;
  CHECK(describer_of(folder, copying()).describe(halves(16, 8, 7, 7)) == ImageDescriptor());
  CHECK(describer_of(folder, copying(1, 0.0F)).describe(halves(16, 8, 1, 9)) == ImageDescriptor());
}

TEST_CASE("Different networks have different identities", "[image_describer]") {
  const TemporaryFolder folder;
  CHECK(describer_of(folder, copying()).network() == describer_of(folder, copying()).network());
  CHECK(describer_of(folder, copying()).network() != describer_of(folder, copying(1, 2)).network());
}

TEST_CASE("A network that does not fit is refused with its file, the reason and a way out",
          "[image_describer]") {
  const TemporaryFolder folder;
  PointwiseNetwork large = copying();
  large.width = 32;
  const auto [content, reason] = GENERATE_COPY(
      std::pair<std::string, std::string>{copying(2).onnx(), "input is 1 x 2 x 8 x 16"},
      std::pair<std::string, std::string>{large.onnx(), "output has 256 numbers"},
      std::pair<std::string, std::string>{"no network", "cannot be run as ONNX"});
  const auto file = folder.write("other.onnx", content);
  CHECK_THROWS_WITH(ImageDescriber(file), Catch::Contains(reason) &&
                                              Catch::Contains(file.string()) &&
                                              Catch::Contains("place_recognition.network"));
  CHECK_THROWS_WITH(ImageDescriber(folder.path() / "none.onnx"), Catch::Contains("none.onnx"));
}

TEST_CASE("The shipped network gives the numbers of its training", "[image_describer]") {
  GrayImage image{160, 120, {}};
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      image.pixels.push_back(static_cast<std::uint8_t>((x * x / 40 + 3 * y) % 256));
  const ImageDescriptor found = ImageDescriber(kShipped).describe(image);
  REQUIRE(found.values.size() == 128);
  // First values by torch, as apps/lab/places/train.py prints them; rounding may differ by one.
  const std::vector<int> expected = {-48, -70, -2,  7,   -25, -6, -20, -16,
                                     30,  42,  -20, -38, -3,  30, 6,   -42};
  for (std::size_t i = 0; i < expected.size(); ++i)
    CHECK(std::abs(int{found.values[i]} - expected[i]) <= 1);
}

TEST_CASE("A recorded image at half the light is nearer to itself than to any other keyframe",
          "[image_describer]") {
  const auto folder = shared_data("euroc/V1_01_easy/keyframes");
  if (!folder) return;
  ImageDescriber describer(kShipped);
  DescriptorDatabase database;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(*folder))
    if (entry.path().string().ends_with("_0.jpg")) files.push_back(entry.path());
  REQUIRE(files.size() == 100);
  for (const auto& file : files) database.add(describer.describe(load(file)));
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto matches = database.search(describer.describe(darker(load(files[i]))), 0.9, 100);
    REQUIRE_FALSE(matches.empty());
    nearest += matches.front().index == i ? 1 : 0;
  }
  CHECK(nearest == files.size());
}

}  // namespace
}  // namespace km
