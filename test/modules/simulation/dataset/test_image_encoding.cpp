#include <catch2/catch.hpp>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

#include "modules/simulation/dataset/image_encoding.hpp"

namespace km {
namespace {

constexpr int kWidth = 31;  // no multiple of anything
constexpr int kHeight = 17;
constexpr std::size_t kPixels = 31 * 17;

template <typename T>
std::vector<T> random_values(std::uint32_t max, std::size_t count = kPixels) {
  std::mt19937 random(5);
  std::vector<T> values(count);
  for (T& value : values) value = static_cast<T>(random() % (max + 1));
  return values;
}

template <typename T>
std::vector<T> pixels_of(const cv::Mat& image) {
  REQUIRE(image.isContinuous());
  const T* const first = image.ptr<T>();
  return {first, first + image.total() * static_cast<std::size_t>(image.channels())};
}

}  // namespace

TEST_CASE("PNG images come back as they were", "[simulation][dataset]") {
  SECTION("grey") {
    const auto pixels = random_values<std::uint8_t>(255);
    const auto bytes = encode_gray({kWidth, kHeight, pixels}, ImageFormat::kPng);
    const cv::Mat image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
    REQUIRE(image.type() == CV_8UC1);
    CHECK(pixels_of<std::uint8_t>(image) == pixels);
  }
  SECTION("depth, 16 bit") {
    const auto pixels = random_values<std::uint16_t>(65535);
    const cv::Mat image = cv::imdecode(encode_depth(kWidth, kHeight, pixels), cv::IMREAD_UNCHANGED);
    REQUIRE(image.type() == CV_16UC1);
    CHECK(pixels_of<std::uint16_t>(image) == pixels);
  }
  SECTION("labels") {
    const auto pixels = random_values<LabelId>(17);
    const cv::Mat image =
        cv::imdecode(encode_labels(kWidth, kHeight, pixels), cv::IMREAD_UNCHANGED);
    REQUIRE(image.type() == CV_8UC1);
    CHECK(pixels_of<std::uint8_t>(image) == pixels);
  }
  SECTION("colour, red first") {
    auto pixels = random_values<std::uint8_t>(255, 3 * kPixels);
    const cv::Mat image =
        cv::imdecode(encode_color(kWidth, kHeight, pixels, ImageFormat::kPng), cv::IMREAD_COLOR);
    const auto bgr = image.at<cv::Vec3b>(0, 1);
    CHECK(bgr[2] == pixels[3]);
    CHECK(bgr[1] == pixels[4]);
    CHECK(bgr[0] == pixels[5]);
  }
}

TEST_CASE("Equal images have equal bytes", "[simulation][dataset]") {
  const auto format = GENERATE(ImageFormat::kJpeg, ImageFormat::kPng);
  const GrayImage image{kWidth, kHeight, random_values<std::uint8_t>(255)};
  CHECK(encode_gray(image, format) == encode_gray(image, format));
}

TEST_CASE("JPEG keeps a smooth image to a grey level", "[simulation][dataset]") {
  GrayImage image{64, 48, {}};
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image.pixels.push_back(static_cast<std::uint8_t>(40 + 2 * x + y));
  const cv::Mat decoded =
      cv::imdecode(encode_gray(image, ImageFormat::kJpeg), cv::IMREAD_UNCHANGED);
  REQUIRE(decoded.type() == CV_8UC1);
  const auto pixels = pixels_of<std::uint8_t>(decoded);
  int largest = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    largest = std::max(largest, std::abs(pixels[i] - image.pixels[i]));
  CHECK(largest <= 2);  // grey levels: quality 92 divides the lowest frequencies by 2 or 3
}

TEST_CASE("Images of the wrong size are refused", "[simulation][dataset]") {
  CHECK_THROWS_AS(encode_gray({4, 4, std::vector<std::uint8_t>(15)}, ImageFormat::kPng),
                  std::invalid_argument);
  CHECK_THROWS_AS(encode_gray({-4, -4, std::vector<std::uint8_t>(16)}, ImageFormat::kPng),
                  std::invalid_argument);
  CHECK_THROWS_AS(encode_depth(4, 4, std::vector<std::uint16_t>(17)), std::invalid_argument);
  CHECK_THROWS_AS(encode_labels(0, 0, {}), std::invalid_argument);
  CHECK_THROWS_AS(encode_color(2, 2, std::vector<std::uint8_t>(4), ImageFormat::kPng),
                  std::invalid_argument);
}

}  // namespace km
