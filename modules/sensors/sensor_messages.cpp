#include "modules/sensors/sensor_messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "modules/core/camera/image_size.hpp"
#include "modules/core/io/text_rows.hpp"

namespace km {
namespace {

constexpr int kAsItIs = -1;

// Storage of pixels, and the conversions to grey and to colours.
struct Encoding {
  std::string_view name;
  int type;
  int to_gray = kAsItIs;  // code of cv::cvtColor
  int to_bgr = kAsItIs;   // code of cv::cvtColor
};

// sensor_msgs/image_encodings.hpp. OpenCV names a Bayer pattern by its second row and column.
constexpr Encoding kEncodings[] = {
    {"mono8", CV_8UC1},
    {"8UC1", CV_8UC1},
    {"mono16", CV_16UC1},
    {"16UC1", CV_16UC1},
    {"bgr8", CV_8UC3, cv::COLOR_BGR2GRAY},
    {"8UC3", CV_8UC3, cv::COLOR_BGR2GRAY},
    {"rgb8", CV_8UC3, cv::COLOR_RGB2GRAY, cv::COLOR_RGB2BGR},
    {"bgra8", CV_8UC4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    {"8UC4", CV_8UC4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    {"rgba8", CV_8UC4, cv::COLOR_RGBA2GRAY, cv::COLOR_RGBA2BGR},
    {"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2GRAY, cv::COLOR_BayerBG2BGR},
    {"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2GRAY, cv::COLOR_BayerRG2BGR},
    {"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2GRAY, cv::COLOR_BayerGR2BGR},
    {"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2GRAY, cv::COLOR_BayerGB2BGR},
    {"yuv422", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY},
    {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2, cv::COLOR_YUV2BGR_YUY2},
    {"32FC1", CV_32FC1},
};

const Encoding* find_encoding(std::string_view name) {
  for (const Encoding& encoding : kEncodings)
    if (encoding.name == name) return &encoding;
  return nullptr;
}

// Reverses the bytes of numbers of two or four bytes.
template <typename Word>
void reverse_bytes(cv::Mat& image) {
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      std::uint8_t* const bytes = image.ptr(y, x);
      std::reverse(bytes, bytes + sizeof(Word));
    }
}

LoadedImage<cv::Mat> pixels_of(const RosImage& image, const Encoding& encoding,
                               const std::string& place, const cv::Size& size) {
  const cv::Size found(static_cast<int>(image.width), static_cast<int>(image.height));
  if (std::cmp_not_equal(image.width, size.width) || std::cmp_not_equal(image.height, size.height))
    return wrong_size(place, found, size);
  const std::size_t row_bytes = image.width * static_cast<std::size_t>(CV_ELEM_SIZE(encoding.type));
  if (image.step < row_bytes)
    return image_failure(ReaderFault::kUnreadableImage, place,
                         "rows of " + std::to_string(image.step) + " bytes, " +
                             std::to_string(row_bytes) + " are needed for " + image.encoding);
  cv::Mat pixels(found, encoding.type);
  for (int y = 0; y < found.height; ++y)
    std::memcpy(pixels.ptr(y), image.data.data() + static_cast<std::size_t>(y) * image.step,
                row_bytes);
  const bool is_native = (image.is_bigendian != 0) == (std::endian::native == std::endian::big);
  if (!is_native && encoding.type == CV_16UC1) reverse_bytes<std::uint16_t>(pixels);
  if (!is_native && encoding.type == CV_32FC1) reverse_bytes<float>(pixels);
  return {std::nullopt, {}, std::move(pixels)};
}

struct RawImage {
  LoadedImage<cv::Mat> loaded;
  int to_gray = kAsItIs;
  int to_bgr = kAsItIs;
};

RawImage raw_image(const BagChannel& channel, const BagMessage& message, const std::string& place,
                   const cv::Size& size) {
  const auto image = decode_ros<RosImage>(channel.encoding, message.bytes);
  if (!image.value) return {image_failure(ReaderFault::kUnreadableImage, place, image.refusal)};
  const Encoding* const encoding = find_encoding(image.value->encoding);
  if (encoding == nullptr)
    return {image_failure(ReaderFault::kWrongImageFormat, place,
                          "the encoding " + readable(image.value->encoding, 40) +
                              " is none of mono, rgb, bgr, bayer of 8 bits, yuv422, 16UC1, 32FC1")};
  return {pixels_of(*image.value, *encoding, place, size), encoding->to_gray, encoding->to_bgr};
}

// Header of image_transport's compressedDepth before the compressed image: a number of the format,
// and two numbers of the quantisation. Metres are stored as A / depth + B.
struct DepthHeader {
  std::uint32_t format = 0;
  float A = 0.0F, B = 0.0F;
};
constexpr std::size_t kDepthHeader_bytes = 12;

// Depths of 16 bits from run lengths and differences in groups of 3 bits (Wilson, "Fast Lossless
// Depth Image Compression", 2017); nullopt for other bytes.
std::optional<cv::Mat> decode_rvl(std::string_view bytes, const cv::Size& size) {
  cv::Mat image(size, CV_16UC1, cv::Scalar(0));
  std::size_t nibble = 0;
  bool is_good = true;
  const auto number = [&] {
    std::uint32_t value = 0;
    for (unsigned shift = 0; is_good; shift += 3) {
      // Words are little-endian, their highest nibble is the first.
      const std::size_t byte = nibble / 8 * 4 + 3 - nibble % 8 / 2;
      if (byte >= bytes.size() || shift > 30) {
        is_good = false;
        return 0U;
      }
      const auto pair = static_cast<std::uint8_t>(bytes[byte]);
      const unsigned bits = nibble++ % 2 == 0 ? pair >> 4U : pair & 0xFU;
      value |= (bits & 7U) << shift;
      if ((bits & 8U) == 0) break;
    }
    return value;
  };
  std::uint16_t depth = 0;
  auto* const pixels = image.ptr<std::uint16_t>();
  for (std::size_t at = 0; at < image.total();) {
    at += number();  // zeros
    const std::size_t end = at + number();
    if (!is_good || end > image.total()) return std::nullopt;
    for (; at < end; ++at) {
      const std::uint32_t change = number();
      depth = static_cast<std::uint16_t>(depth + ((change >> 1U) ^ (0U - (change & 1U))));
      pixels[at] = depth;
    }
  }
  return is_good ? std::optional(std::move(image)) : std::nullopt;
}

LoadedImage<cv::Mat> rvl_image(std::string_view bytes, const std::string& place,
                               const cv::Size& size) {
  std::array<std::uint32_t, 2> sides{};
  if (bytes.size() < sizeof(sides))
    return image_failure(ReaderFault::kUnreadableImage, place, "truncated RVL");
  std::memcpy(sides.data(), bytes.data(), sizeof(sides));
  if (std::cmp_not_equal(sides[0], size.width) || std::cmp_not_equal(sides[1], size.height))
    return wrong_size(place, {static_cast<int>(sides[0]), static_cast<int>(sides[1])}, size);
  auto image = decode_rvl(bytes.substr(sizeof(sides)), size);
  if (!image) return image_failure(ReaderFault::kUnreadableImage, place, "damaged RVL");
  return {std::nullopt, {}, *std::move(image)};
}

// Names the format of an image that is neither PNG nor JPEG nor RVL.
std::string format_text(const std::string& format) {
  return "; the message states the format '" + readable(format, 60) +
         "', PNG, JPEG and RVL are read: publish raw or JPEG images (videos such as h264 and other "
         "transports: ros2 run image_transport republish ... raw)";
}

LoadedImage<cv::Mat> compressed_image(const BagChannel& channel, const BagMessage& message,
                                      const std::string& place, DecodedPixels pixels,
                                      const cv::Size& size) {
  const auto image = decode_ros<RosCompressedImage>(channel.encoding, message.bytes);
  if (!image.value) return image_failure(ReaderFault::kUnreadableImage, place, image.refusal);
  const auto& data = image.value->data;
  std::string_view bytes(reinterpret_cast<const char*>(data.data()), data.size());
  const std::string& format = image.value->format;
  const auto names = [&format](const char* word) { return format.find(word) != format.npos; };
  const bool has_header =
      bytes.size() > kDepthHeader_bytes &&
      (names("compressedDepth") || bytes.substr(kDepthHeader_bytes).starts_with("\x89PNG")) &&
      !bytes.starts_with("\x89PNG");
  DepthHeader header;
  if (has_header) std::memcpy(&header, bytes.data(), sizeof(header));
  if (has_header) bytes.remove_prefix(kDepthHeader_bytes);
  LoadedImage<cv::Mat> loaded = has_header && names("rvl")
                                    ? rvl_image(bytes, place, size)
                                    : decode_image(bytes, place, pixels, size);
  if (loaded.fault == ReaderFault::kUnreadableImage && !stated_image_size(bytes))
    loaded.problem += format_text(format);
  if (loaded.fault || !has_header || !format.starts_with("32FC1")) return loaded;
  if (!(header.A > 0.0F) || !std::isfinite(header.B) || loaded.image.type() != CV_16UC1)
    return image_failure(ReaderFault::kWrongImageFormat, place,
                         "32FC1; compressedDepth without its two numbers of quantisation");
  cv::Mat metres(loaded.image.size(), CV_32FC1);
  std::transform(loaded.image.begin<std::uint16_t>(), loaded.image.end<std::uint16_t>(),
                 metres.begin<float>(), [&header](std::uint16_t stored) {
                   return stored == 0 ? 0.0F : header.A / (static_cast<float>(stored) - header.B);
                 });
  return {std::nullopt, {}, std::move(metres)};
}

bool is_raw(const BagChannel& channel) {
  return is_of_type(channel, RosImage::kType);
}

}  // namespace

bool has_images(const BagChannel& channel) {
  return is_raw(channel) || is_of_type(channel, RosCompressedImage::kType);
}

std::string_view type_of_images(std::string_view topic) {
  const bool is_compressed = topic.ends_with("/compressed") || topic.ends_with("/compressedDepth");
  return is_compressed ? RosCompressedImage::kType : RosImage::kType;
}

ImageResult gray_of_message(const BagChannel& channel, const BagMessage& message,
                            const std::string& place, const cv::Size& size) {
  RawImage raw =
      is_raw(channel)
          ? raw_image(channel, message, place, size)
          : RawImage{compressed_image(channel, message, place, DecodedPixels::kGray, size)};
  if (raw.loaded.fault) return failure_of<GrayImage>(raw.loaded);
  cv::Mat gray = raw.loaded.image;
  if (raw.to_gray != kAsItIs) {
    gray = cv::Mat();  // a Bayer pattern cannot be converted in place
    cv::cvtColor(raw.loaded.image, gray, raw.to_gray);
  }
  if (gray.type() == CV_16UC1) gray = upper_bits(gray);
  if (gray.type() != CV_8UC1)
    return {ReaderFault::kWrongImageFormat, place + ": metres are no grey values", {}};
  return {std::nullopt, {}, {gray.cols, gray.rows, {gray.datastart, gray.dataend}}};
}

ColorImage color_of_message(const BagChannel& channel, const BagMessage& message,
                            const cv::Size& size) {
  RawImage raw =
      is_raw(channel)
          ? raw_image(channel, message, {}, size)
          : RawImage{compressed_image(channel, message, {}, DecodedPixels::kEightBits, size)};
  if (!raw.loaded.fault && raw.to_bgr != kAsItIs) {
    cv::Mat bgr;
    cv::cvtColor(raw.loaded.image, bgr, raw.to_bgr);
    raw.loaded.image = bgr;
  }
  return color_image_of(raw.loaded);
}

DepthResult depth_of_message(const BagChannel& channel, const BagMessage& message,
                             const std::string& place, const cv::Size& size, double scale_m,
                             const DepthRange& range) {
  return depth_image_of(
      is_raw(channel) ? raw_image(channel, message, place, size).loaded
                      : compressed_image(channel, message, place, DecodedPixels::kStored, size),
      place, scale_m, range);
}

bool is_of_kind(const BagChannel& channel, const SensorKind& kind) {
  return kind.type.empty() ? has_images(channel) : is_of_type(channel, kind.type);
}

std::vector<SensorTopic> sensor_topics(const SensorTopicNames& names) {
  std::vector<SensorTopic> topics;
  for (const SensorKind& kind : kSensorKinds) {
    const std::string& topic = names.*kind.topic;
    if (!topic.empty())
      topics.push_back({&kind, topic, kind.type.empty() ? type_of_images(topic) : kind.type});
  }
  return topics;
}

}  // namespace km
