#include "modules/sensors/image_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "modules/core/camera/image_size.hpp"
#include "modules/core/io/input_file.hpp"

namespace km {
namespace {

// No camera of a rig has a larger image in any format.
constexpr std::uintmax_t kMaxEncoded_bytes = std::uintmax_t{256} << 20U;

// True without the end marker in the last 64 bytes. Elsewhere the marker may be that of a
// thumbnail.
bool is_truncated(std::string_view bytes) {
  const std::string_view tail =
      bytes.substr(bytes.size() - std::min<std::size_t>(64, bytes.size()));
  if (bytes.starts_with("\xFF\xD8")) return tail.find("\xFF\xD9") == tail.npos;
  if (bytes.starts_with("\x89PNG")) return tail.find("IEND") == tail.npos;
  return false;
}

// The size in the header. A decoder allocates memory for this size before it decodes.
std::optional<cv::Size> stated_size(std::string_view bytes) {
  const auto size = stated_image_size(bytes);
  if (!size) return std::nullopt;
  return cv::Size(static_cast<int>(size->width), static_cast<int>(size->height));
}

std::string text(const cv::Size& size) {
  return std::to_string(size.width) + 'x' + std::to_string(size.height);
}

constexpr std::uint16_t kNoMeasurement = 65535;
constexpr double kMaxStored_mm = 65535.0;

// Sets the ids of an image of BGR or BGRA pixels, with one lookup per run of equal colours.
void map_colors(const cv::Mat& image, const LabelPalette& palette, LabelResult& result) {
  const int channels = image.channels();
  std::optional<std::array<std::uint8_t, 3>> last;
  std::optional<LabelId> id;
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* bgr = image.ptr(y);
    for (int x = 0; x < image.cols; ++x, bgr += channels) {
      const std::array<std::uint8_t, 3> color = {bgr[2], bgr[1], bgr[0]};
      if (color != last) id = palette.id_of(color);
      last = color;
      result.image.ids.push_back(id.value_or(0));
      result.unknown_pixels += id ? 0 : 1;
    }
  }
}

}  // namespace

ImageResult load_gray_image(const std::filesystem::path& file, int width, int height) {
  LoadedImage<cv::Mat> loaded = decode_image(file, DecodedPixels::kGray, {width, height});
  if (loaded.fault) return failure_of<GrayImage>(loaded);
  const cv::Mat& decoded = loaded.image;
  return {std::nullopt, {}, {width, height, {decoded.datastart, decoded.dataend}}};
}

ColorImage color_image_of(const LoadedImage<cv::Mat>& decoded) {
  const cv::Mat& bgr = decoded.image;
  if (bgr.type() != CV_8UC3) return {};
  ColorImage color{bgr.cols, bgr.rows, {}};
  color.pixels.reserve(bgr.total());
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x) {
      const std::uint8_t* const pixel = bgr.ptr(y, x);
      color.pixels.push_back({pixel[2], pixel[1], pixel[0]});
    }
  return color;
}

LoadedImage<cv::Mat> image_failure(ReaderFault fault, const std::string& place,
                                   const std::string& why) {
  return {fault, place + ": " + why, {}};
}

LoadedImage<cv::Mat> wrong_size(const std::string& place, const cv::Size& found,
                                const cv::Size& size) {
  return image_failure(ReaderFault::kWrongImageSize, place,
                       text(found) + " px, the calibration states " + text(size));
}

LoadedImage<cv::Mat> decode_image(const std::filesystem::path& file, DecodedPixels pixels,
                                  const cv::Size& size) {
  if (!is_file(file))
    return image_failure(ReaderFault::kMissingImage, file.string(),
                         "no such image" + (is_absent(file) ? "" : ": " + problem_of_file(file)));
  try {
    return decode_image(read_input_file(file, kMaxEncoded_bytes), file.string(), pixels, size);
  } catch (const InputFileError& error) {
    return {ReaderFault::kUnreadableImage, error.what(), {}};
  }
}

LoadedImage<cv::Mat> decode_image(std::string_view bytes, const std::string& place,
                                  DecodedPixels pixels, const cv::Size& size) {
  const auto unreadable = [&place](const std::string& why) {
    return image_failure(ReaderFault::kUnreadableImage, place, why);
  };
  if (bytes.empty()) return unreadable("empty file");
  if (is_truncated(bytes)) return unreadable("truncated image");
  if (const auto stated = stated_size(bytes); stated && *stated != size)
    return wrong_size(place, *stated, size);

  try {
    cv::Mat decoded = decode_pixels(bytes, pixels);
    if (decoded.size() != size) return wrong_size(place, decoded.size(), size);
    return {std::nullopt, {}, std::move(decoded)};
  } catch (const ImageCodecError& error) {
    return unreadable(std::string("cannot be decoded: ") + error.what());
  }
}

DepthResult load_depth_image(const std::filesystem::path& file, int width, int height,
                             double scale_m, const DepthRange& range) {
  return depth_image_of(decode_image(file, DecodedPixels::kStored, {width, height}), file.string(),
                        scale_m, range);
}

DepthResult depth_image_of(const LoadedImage<cv::Mat>& decoded, const std::string& place,
                           double scale_m, const DepthRange& range) {
  if (decoded.fault) return failure_of<DepthImage>(decoded);
  const cv::Mat& image = decoded.image;
  const double min_mm = 1e3 * range.min_m;
  const double max_mm = std::min(1e3 * range.max_m, kMaxStored_mm);
  const auto stored = [&](double depth_mm) {
    const bool measured = depth_mm > 0.0 && depth_mm >= min_mm && depth_mm <= max_mm;  // not NaN
    return measured ? static_cast<std::uint16_t>(std::lround(depth_mm)) : std::uint16_t{0};
  };
  DepthResult result;
  result.image = {image.cols, image.rows, std::vector<std::uint16_t>(image.total())};
  std::uint16_t* const values = result.image.millimetres.data();
  if (image.type() == CV_16UC1) {
    const double scale_mm = 1e3 * scale_m;
    std::transform(image.begin<std::uint16_t>(), image.end<std::uint16_t>(), values,
                   [&](std::uint16_t units) {
                     return units == kNoMeasurement ? std::uint16_t{0} : stored(scale_mm * units);
                   });
  } else if (image.type() == CV_32FC1) {
    std::transform(image.begin<float>(), image.end<float>(), values,
                   [&](float depth_m) { return stored(1e3 * static_cast<double>(depth_m)); });
  } else {
    return {ReaderFault::kWrongImageFormat,
            place + ": " + std::to_string(8 * image.elemSize1()) + " bits and " +
                std::to_string(image.channels()) +
                " channels, depth is an image of 16 bits and one channel, or of metres",
            {}};
  }
  return result;
}

LabelResult load_label_image(const std::filesystem::path& file, int width, int height,
                             const LabelPalette& palette) {
  LoadedImage<cv::Mat> loaded = decode_image(file, DecodedPixels::kStored, {width, height});
  if (loaded.fault) return {failure_of<LabelImage>(loaded), 0};
  const cv::Mat& decoded = loaded.image;
  LabelResult result;
  result.image = {width, height, {}};
  if (decoded.type() == CV_8UC1) {
    result.image.ids.assign(decoded.begin<std::uint8_t>(), decoded.end<std::uint8_t>());
    return result;
  }
  const bool is_color = decoded.type() == CV_8UC3 || decoded.type() == CV_8UC4;
  const std::string problem = !is_color ? "labels are 8-bit ids or 8-bit colours"
                              : palette.classes().empty()
                                  ? "labels as colours, but no label_palette.csv to map them"
                                  : "";
  if (!problem.empty())
    return {{ReaderFault::kWrongImageFormat, file.string() + ": " + problem, {}}, 0};
  result.image.ids.reserve(decoded.total());
  map_colors(decoded, palette, result);
  return result;
}

}  // namespace km
