#include "modules/images/image_codec.hpp"

#include <spng.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>

#include "modules/core/io/input_file.hpp"

namespace km {
namespace {

// Longest text, colour profile or other part beside the pixels of a PNG file, and largest sum of
// all of them, unpacked [B]. Without a limit, a file of 8 MB takes 8 GB of memory.
constexpr std::size_t kMaxUnpackedText = std::size_t{8} << 20U;

using Png = std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)>;
using Jpeg = std::unique_ptr<void, decltype(&tjDestroy)>;

// Throws if a function of libspng has failed.
void require_png(int status) {
  if (status != SPNG_OK) throw ImageCodecError(std::string("PNG: ") + spng_strerror(status));
}

ImageCodecError jpeg_error(const Jpeg& jpeg) {
  return ImageCodecError(std::string("JPEG: ") + tjGetErrorStr2(jpeg.get()));
}

void require_side(int width, int height) {
  if (width > kMaxImageSide_px || height > kMaxImageSide_px)
    throw ImageCodecError(std::to_string(width) + 'x' + std::to_string(height) + " px, at most " +
                          std::to_string(kMaxImageSide_px) + " are decoded");
}

// An image for decoded pixels.
cv::Mat blank(int width, int height, int type) {
  const std::size_t bytes =
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * CV_ELEM_SIZE(type);
  if (bytes > kMaxDecodedBytes)
    throw ImageCodecError(std::to_string(width) + 'x' + std::to_string(height) + " px, at most " +
                          std::to_string(kMaxDecodedBytes >> 20U) + " MiB are decoded");
  return cv::Mat(height, width, type);
}

cv::Mat converted(const cv::Mat& image, int code) {
  cv::Mat result;
  cv::cvtColor(image, result, code);
  return result;
}

// libspng's format and OpenCV's type in which the pixels of a PNG file are decoded.
struct PngPixels {
  int format;
  int type;
};

PngPixels pixels_of(const spng_ihdr& header, bool has_transparency) {
  if (header.color_type == SPNG_COLOR_TYPE_GRAYSCALE)
    return header.bit_depth == 16 ? PngPixels{SPNG_FMT_PNG, CV_16UC1}
                                  : PngPixels{SPNG_FMT_G8, CV_8UC1};
  const bool has_alpha = header.color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA ||
                         header.color_type == SPNG_COLOR_TYPE_TRUECOLOR_ALPHA || has_transparency;
  return has_alpha ? PngPixels{SPNG_FMT_RGBA8, CV_8UC4} : PngPixels{SPNG_FMT_RGB8, CV_8UC3};
}

// `image` is grey, RGB or RGBA.
cv::Mat as_wanted(const cv::Mat& image, DecodedPixels pixels) {
  const bool gray = pixels == DecodedPixels::kGray;
  if (image.type() == CV_8UC4 && pixels == DecodedPixels::kEightBits)
    return converted(image, cv::COLOR_RGBA2BGR);
  if (image.type() == CV_8UC4)
    return converted(image, gray ? cv::COLOR_RGBA2GRAY : cv::COLOR_RGBA2BGRA);
  if (image.type() == CV_8UC3)
    return converted(image, gray ? cv::COLOR_RGB2GRAY : cv::COLOR_RGB2BGR);
  return image.type() == CV_16UC1 && pixels != DecodedPixels::kStored ? upper_bits(image) : image;
}

cv::Mat decode_png(std::string_view file, DecodedPixels pixels) {
  const Png png(spng_ctx_new(0), spng_ctx_free);
  if (!png) throw ImageCodecError("PNG: no memory");
  require_png(spng_set_image_limits(png.get(), kMaxImageSide_px, kMaxImageSide_px));
  require_png(spng_set_chunk_limits(png.get(), kMaxUnpackedText, kMaxUnpackedText));
  require_png(spng_set_png_buffer(png.get(), file.data(), file.size()));
  spng_ihdr header{};
  require_png(spng_get_ihdr(png.get(), &header));
  spng_trns transparency{};
  const int transparency_status = spng_get_trns(png.get(), &transparency);
  if (transparency_status != SPNG_ECHUNKAVAIL) require_png(transparency_status);
  const bool is_transparent = transparency_status == SPNG_OK;
  const auto [format, type] = pixels_of(header, is_transparent);
  cv::Mat image = blank(static_cast<int>(header.width), static_cast<int>(header.height), type);
  require_png(spng_decode_image(png.get(), image.data, image.total() * image.elemSize(), format,
                                type == CV_8UC4 ? SPNG_DECODE_TRNS : 0));
  return as_wanted(image, pixels);
}

cv::Mat decode_jpeg(std::string_view file, DecodedPixels pixels) {
  const Jpeg jpeg(tjInitDecompress(), tjDestroy);
  if (!jpeg) throw ImageCodecError("JPEG: no memory");
  const auto* const bytes = reinterpret_cast<const unsigned char*>(file.data());
  int width = 0, height = 0, sampling = 0, colors = 0;
  if (tjDecompressHeader3(jpeg.get(), bytes, file.size(), &width, &height, &sampling, &colors) != 0)
    throw jpeg_error(jpeg);
  if (width <= 0 || height <= 0) throw ImageCodecError("JPEG: no size in the header");
  require_side(width, height);
  if (colors == TJCS_CMYK || colors == TJCS_YCCK) throw ImageCodecError("JPEG: colours of print");
  const bool gray = pixels == DecodedPixels::kGray || colors == TJCS_GRAY;
  cv::Mat image = blank(width, height, gray ? CV_8UC1 : CV_8UC3);
  const int status =
      tjDecompress2(jpeg.get(), bytes, file.size(), image.data, width, static_cast<int>(image.step),
                    height, gray ? TJPF_GRAY : TJPF_BGR, TJFLAG_ACCURATEDCT);
  // Cameras write files that cause warnings, as for extra bytes, and decode well.
  if (status != 0 && tjGetErrorCode(jpeg.get()) == TJERR_FATAL) throw jpeg_error(jpeg);
  return image;
}

}  // namespace

cv::Mat decode_pixels(std::string_view file, DecodedPixels pixels) {
  if (file.starts_with("\x89PNG")) return decode_png(file, pixels);
  if (file.starts_with("\xFF\xD8")) return decode_jpeg(file, pixels);
  throw ImageCodecError("neither a PNG nor a JPEG file");
}

cv::Mat read_pixels(const std::filesystem::path& file, DecodedPixels pixels) {
  try {
    return decode_pixels(read_input_file(file), pixels);
  } catch (const ImageCodecError& error) {
    throw ImageCodecError(file.string() + ": " + error.what());
  }
}

cv::Mat upper_bits(const cv::Mat& image) {
  const unsigned largest =
      *std::max_element(image.begin<std::uint16_t>(), image.end<std::uint16_t>());
  const int unused = largest < 4096 ? 4 : 8;
  cv::Mat gray(image.size(), CV_8UC1);
  std::transform(
      image.begin<std::uint16_t>(), image.end<std::uint16_t>(), gray.begin<std::uint8_t>(),
      [unused](std::uint16_t value) { return static_cast<std::uint8_t>(value >> unused); });
  return gray;
}

std::vector<std::uint8_t> encode_png(const cv::Mat& image) {
  constexpr int kLevel = 1;  // level 6 takes three times as long for a tenth less
  const int type = image.type();
  if (image.empty() || (type != CV_8UC1 && type != CV_8UC3 && type != CV_8UC4 && type != CV_16UC1))
    throw ImageCodecError("PNG: not a grey image of 8 or 16 bits, BGR or BGRA");
  const cv::Mat stored = type == CV_8UC3        ? converted(image, cv::COLOR_BGR2RGB)
                         : type == CV_8UC4      ? converted(image, cv::COLOR_BGRA2RGBA)
                         : image.isContinuous() ? image
                                                : image.clone();
  const Png png(spng_ctx_new(SPNG_CTX_ENCODER), spng_ctx_free);
  if (!png) throw ImageCodecError("PNG: no memory");
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(stored.cols);
  header.height = static_cast<std::uint32_t>(stored.rows);
  header.bit_depth = type == CV_16UC1 ? 16 : 8;
  header.color_type = type == CV_8UC3   ? SPNG_COLOR_TYPE_TRUECOLOR
                      : type == CV_8UC4 ? SPNG_COLOR_TYPE_TRUECOLOR_ALPHA
                                        : SPNG_COLOR_TYPE_GRAYSCALE;
  require_png(spng_set_option(png.get(), SPNG_ENCODE_TO_BUFFER, 1));
  require_png(spng_set_option(png.get(), SPNG_IMG_COMPRESSION_LEVEL, kLevel));
  require_png(spng_set_ihdr(png.get(), &header));
  require_png(spng_encode_image(png.get(), stored.data, stored.total() * stored.elemSize(),
                                SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE));
  std::size_t size = 0;
  int status = SPNG_OK;
  const std::unique_ptr<void, decltype(&std::free)> bytes(
      spng_get_png_buffer(png.get(), &size, &status), std::free);
  require_png(status);
  const auto* const first = static_cast<const std::uint8_t*>(bytes.get());
  return {first, first + size};
}

std::vector<std::uint8_t> encode_jpeg(const cv::Mat& image, int quality) {
  const bool gray = image.type() == CV_8UC1;
  if (image.empty() || (!gray && image.type() != CV_8UC3))
    throw ImageCodecError("JPEG: not an image of 8 bits or BGR");
  const Jpeg jpeg(tjInitCompress(), tjDestroy);
  if (!jpeg) throw ImageCodecError("JPEG: no memory");
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int status = tjCompress2(jpeg.get(), image.data, image.cols, static_cast<int>(image.step),
                                 image.rows, gray ? TJPF_GRAY : TJPF_BGR, &bytes, &size,
                                 gray ? TJSAMP_GRAY : TJSAMP_420, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owner(bytes, tjFree);
  if (status != 0) throw jpeg_error(jpeg);
  return {bytes, bytes + size};
}

}  // namespace km
