#include <catch2/catch.hpp>
#include <cmath>

#include "modules/core/config.hpp"
#include "modules/place_recognition/image_describer.hpp"
#include "test/support/onnx_model.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

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

}  // namespace
}  // namespace km
