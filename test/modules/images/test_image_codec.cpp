#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <zlib.h>

#include "test/support/image_file.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;

// A picture with even surfaces, edges and noise.
cv::Mat picture(int type) {
  cv::Mat image(37, 61, type);
  cv::randu(image, cv::Scalar::all(0), cv::Scalar::all(CV_MAT_DEPTH(type) == CV_16U ? 65535 : 255));
  cv::GaussianBlur(image, image, {5, 5}, 0.0);
  cv::rectangle(image, {10, 10, 30, 15}, cv::Scalar(200, 30, 90, 128), cv::FILLED);
  return image;
}

Bytes of_opencv(const char* extension, const cv::Mat& image, const std::vector<int>& options = {}) {
  Bytes bytes;
  REQUIRE(cv::imencode(extension, image, bytes, options));
  return bytes;
}

double largest_difference(const cv::Mat& a, const cv::Mat& b) {
  REQUIRE(a.type() == b.type());
  REQUIRE(a.size() == b.size());
  return cv::norm(a, b, cv::NORM_INF);
}

// A PNG file of two pixels, the second and the first colour of a palette of red and blue, where
// red is half transparent.
const Bytes kPalette = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44,
    0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x08, 0x03, 0x00, 0x00, 0x00, 0xc3,
    0xfc, 0x8f, 0xb8, 0x00, 0x00, 0x00, 0x06, 0x50, 0x4c, 0x54, 0x45, 0xff, 0x00, 0x00, 0x00,
    0x00, 0xff, 0x6c, 0xa1, 0xfd, 0x8e, 0x00, 0x00, 0x00, 0x01, 0x74, 0x52, 0x4e, 0x53, 0x80,
    0xad, 0x5e, 0x5b, 0x46, 0x00, 0x00, 0x00, 0x0b, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63,
    0x60, 0x64, 0x00, 0x00, 0x00, 0x05, 0x00, 0x02, 0xd1, 0x66, 0x33, 0x78, 0x00, 0x00, 0x00,
    0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

TEST_CASE("Colours of a palette are looked up") {
  const cv::Mat stored = decoded(kPalette, DecodedPixels::kStored);
  CHECK(largest_difference(stored, (cv::Mat_<cv::Vec4b>(1, 2) << cv::Vec4b(255, 0, 0, 255),
                                    cv::Vec4b(0, 0, 255, 128))) == 0.0);
  CHECK(largest_difference(
            decoded(kPalette, DecodedPixels::kEightBits),
            (cv::Mat_<cv::Vec3b>(1, 2) << cv::Vec3b(255, 0, 0), cv::Vec3b(0, 0, 255))) == 0.0);
}

TEST_CASE("PNG files are decoded as OpenCV decodes them") {
  const int type = GENERATE(CV_8UC1, CV_16UC1, CV_8UC3, CV_8UC4);
  CAPTURE(type);
  const cv::Mat image = picture(type);
  const Bytes file = of_opencv(".png", image);
  CHECK(largest_difference(decoded(file, DecodedPixels::kStored), image) == 0.0);
  CHECK(largest_difference(decoded(file, DecodedPixels::kEightBits),
                           cv::imdecode(file, cv::IMREAD_ANYCOLOR)) == 0.0);
  // The weights of the colours are rounded in another place.
  CHECK(largest_difference(decoded(file, DecodedPixels::kGray),
                           cv::imdecode(file, cv::IMREAD_GRAYSCALE)) <= 1.0);
}

TEST_CASE("JPEG files are decoded as OpenCV decodes them") {
  const int type = GENERATE(CV_8UC1, CV_8UC3);
  const int quality = GENERATE(30, 92);
  CAPTURE(type, quality);
  const Bytes file = of_opencv(".jpg", picture(type), {cv::IMWRITE_JPEG_QUALITY, quality});
  for (const DecodedPixels stored : {DecodedPixels::kStored, DecodedPixels::kEightBits})
    CHECK(largest_difference(decoded(file, stored), cv::imdecode(file, cv::IMREAD_UNCHANGED)) ==
          0.0);
  CHECK(largest_difference(decoded(file, DecodedPixels::kGray),
                           cv::imdecode(file, cv::IMREAD_GRAYSCALE)) == 0.0);
}

TEST_CASE("OpenCV decodes encoded files") {
  const int type = GENERATE(CV_8UC1, CV_16UC1, CV_8UC3, CV_8UC4);
  CAPTURE(type);
  const cv::Mat image = picture(type);
  CHECK(largest_difference(cv::imdecode(encode_png(image), cv::IMREAD_UNCHANGED), image) == 0.0);
  if (type == CV_16UC1 || type == CV_8UC4) return;
  const cv::Mat jpeg = cv::imdecode(encode_jpeg(image, 92), cv::IMREAD_UNCHANGED);
  const cv::Mat judge =
      cv::imdecode(of_opencv(".jpg", image, {cv::IMWRITE_JPEG_QUALITY, 92}), cv::IMREAD_UNCHANGED);
  CHECK(largest_difference(jpeg, judge) <= 2.0);
}

TEST_CASE("A part of a larger image is encoded") {
  const cv::Mat part = picture(CV_8UC1)(cv::Rect(8, 9, 20, 11));
  CHECK(largest_difference(decoded(encode_png(part), DecodedPixels::kStored), part) == 0.0);
  CHECK(largest_difference(decoded(encode_jpeg(part, 100), DecodedPixels::kStored), part) <= 4.0);
}

std::string why(const std::string& file) {
  try {
    return std::to_string(decode_pixels(file, DecodedPixels::kGray).cols) + " columns";
  } catch (const ImageCodecError& error) {
    return std::string(error.what());
  }
}

std::string four_bytes(std::uint64_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8)
    bytes.push_back(static_cast<char>(value >> static_cast<unsigned>(shift) & 0xFFU));
  return bytes;
}

std::string chunk(const std::string& type, const std::string& content) {
  const std::string checked = type + content;
  const auto* const bytes = reinterpret_cast<const Bytef*>(checked.data());
  return four_bytes(content.size()) + checked +
         four_bytes(crc32(0, bytes, static_cast<uInt>(checked.size())));
}

std::string compressed_zeros(std::size_t count) {
  const Bytes zeros(count);
  uLongf size = compressBound(count);
  std::string packed(size, '\0');
  REQUIRE(compress2(reinterpret_cast<Bytef*>(packed.data()), &size, zeros.data(), count, 1) ==
          Z_OK);
  packed.resize(size);
  return packed;
}

constexpr std::size_t kHeaderEnd = 33;  // signature and IHDR of a PNG file

// A PNG file with these chunks before its pixels.
std::string png_with(const std::string& chunks) {
  const Bytes file = encode_png(picture(CV_8UC1));
  return std::string(file.begin(), file.end()).insert(kHeaderEnd, chunks);
}

TEST_CASE("A PNG file whose text or colour profile unpacks to more than 8 MiB is not decoded") {
  using namespace std::string_literals;
  CHECK(why(png_with(chunk("zTXt", "key\0\0"s + compressed_zeros(1U << 20U)))) == "61 columns");
  const std::string zeros = compressed_zeros(9U << 20U);
  const std::string bomb =
      GENERATE_COPY(chunk("zTXt", "key\0\0"s + zeros), chunk("iTXt", "key\0\1\0\0\0"s + zeros),
                    chunk("iCCP", "key\0\0"s + zeros));
  CAPTURE(bomb.substr(4, 4));
  CHECK(why(png_with(bomb)) == "PNG: reached chunk/cache limits");
  const std::string half = chunk("zTXt", "key\0\0"s + compressed_zeros(5U << 20U));
  CHECK(why(png_with(half + half)) == "PNG: reached chunk/cache limits");
}

TEST_CASE("An image of more than 48 MiB of pixels is not decoded") {
  std::string png = png_with("");
  png.replace(16, 8, four_bytes(16384) + four_bytes(3073));
  png.replace(12, kHeaderEnd - 12, chunk("IHDR", png.substr(16, 13)).substr(4));
  CHECK(why(png) == "16384x3073 px, at most 48 MiB are decoded");
}

TEST_CASE("Files that are no image say why") {
  CHECK(why("") == "neither a PNG nor a JPEG file");
  CHECK(why("GIF89a") == "neither a PNG nor a JPEG file");
  CHECK(why("\x89PNG") == "PNG: end of stream");
  CHECK(why("\xFF\xD8") == "JPEG: no size in the header");
  Bytes wide = encode_png(picture(CV_8UC1));
  wide[17] = 1;  // a width of 65597
  CHECK(why({wide.begin(), wide.end()}) == "PNG: image width exceeds user limit");
  const Bytes jpeg = encode_jpeg(picture(CV_8UC1), 80);
  std::string tall(jpeg.begin(), jpeg.end());
  tall.replace(tall.find("\xFF\xC0") + 5, 2, "\x80\x01");  // the height in the frame header
  CHECK(why(tall) == "61x32769 px, at most 16384 are decoded");
}

TEST_CASE("Images that cannot be stored are refused") {
  CHECK_THROWS_AS(encode_png({}), ImageCodecError);
  CHECK_THROWS_AS(encode_png(cv::Mat(2, 2, CV_32FC1)), ImageCodecError);
  CHECK_THROWS_AS(encode_jpeg({}, 80), ImageCodecError);
  CHECK_THROWS_AS(encode_jpeg(cv::Mat(2, 2, CV_16UC1), 80), ImageCodecError);
}

}  // namespace
}  // namespace km
