#include "modules/sensors/sensor_messages.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <utility>

#include "modules/core/text_rows.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {
namespace {

constexpr int kAsItIs = -1;

// Storage of pixels, and the conversion to grey.
struct Encoding {
  std::string_view name;
  int type;
  int to_gray;  // code of cv::cvtColor
};

// sensor_msgs/image_encodings.hpp. OpenCV names a Bayer pattern by its second row and column.
constexpr Encoding kEncodings[] = {
    {"mono8", CV_8UC1, kAsItIs},
    {"8UC1", CV_8UC1, kAsItIs},
    {"mono16", CV_16UC1, kAsItIs},
    {"16UC1", CV_16UC1, kAsItIs},
    {"bgr8", CV_8UC3, cv::COLOR_BGR2GRAY},
    {"8UC3", CV_8UC3, cv::COLOR_BGR2GRAY},
    {"rgb8", CV_8UC3, cv::COLOR_RGB2GRAY},
    {"bgra8", CV_8UC4, cv::COLOR_BGRA2GRAY},
    {"8UC4", CV_8UC4, cv::COLOR_BGRA2GRAY},
    {"rgba8", CV_8UC4, cv::COLOR_RGBA2GRAY},
    {"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2GRAY},
    {"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2GRAY},
    {"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2GRAY},
    {"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2GRAY},
    {"yuv422", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
    {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2},
    {"32FC1", CV_32FC1, kAsItIs},
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
    return image_failure(ImageStatus::kUnreadable, place,
                         "rows of " + std::to_string(image.step) + " bytes, " +
                             std::to_string(row_bytes) + " are needed for " + image.encoding);
  cv::Mat pixels(found, encoding.type);
  for (int y = 0; y < found.height; ++y)
    std::memcpy(pixels.ptr(y), image.data.data() + static_cast<std::size_t>(y) * image.step,
                row_bytes);
  const bool is_native = (image.is_bigendian != 0) == (std::endian::native == std::endian::big);
  if (!is_native && encoding.type == CV_16UC1) reverse_bytes<std::uint16_t>(pixels);
  if (!is_native && encoding.type == CV_32FC1) reverse_bytes<float>(pixels);
  return {ImageStatus::kOk, {}, std::move(pixels)};
}

struct RawImage {
  LoadedImage<cv::Mat> loaded;
  int to_gray = kAsItIs;
};

RawImage raw_image(const BagChannel& channel, const BagMessage& message, const std::string& place,
                   const cv::Size& size) {
  const auto image = decode_ros<RosImage>(channel.encoding, message.bytes);
  if (!image.value) return {image_failure(ImageStatus::kUnreadable, place, image.refusal)};
  const Encoding* const encoding = find_encoding(image.value->encoding);
  if (encoding == nullptr)
    return {image_failure(ImageStatus::kWrongFormat, place,
                          "the encoding " + readable(image.value->encoding, 40) +
                              " is none of mono, rgb, bgr, bayer of 8 bits, yuv422, 16UC1, 32FC1")};
  return {pixels_of(*image.value, *encoding, place, size), encoding->to_gray};
}

// The bytes without the header of image_transport: 12 bytes with the quantisation before the PNG
// file of a compressed depth image. The header has no meaning for depths of 16 bits.
std::string_view without_depth_header(std::string_view bytes) {
  constexpr std::size_t kHeader_bytes = 12;
  const bool has_header =
      bytes.size() > kHeader_bytes && bytes.substr(kHeader_bytes).starts_with("\x89PNG");
  return has_header ? bytes.substr(kHeader_bytes) : bytes;
}

LoadedImage<cv::Mat> compressed_image(const BagChannel& channel, const BagMessage& message,
                                      const std::string& place, DecodedPixels pixels,
                                      const cv::Size& size) {
  const auto image = decode_ros<RosCompressedImage>(channel.encoding, message.bytes);
  if (!image.value) return image_failure(ImageStatus::kUnreadable, place, image.refusal);
  const auto& data = image.value->data;
  const std::string_view bytes(reinterpret_cast<const char*>(data.data()), data.size());
  return decode_image(without_depth_header(bytes), place, pixels, size);
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
  if (raw.loaded.status != ImageStatus::kOk) return failure_of<GrayImage>(raw.loaded);
  cv::Mat gray = raw.loaded.image;
  if (raw.to_gray != kAsItIs) {
    gray = cv::Mat();  // a Bayer pattern cannot be converted in place
    cv::cvtColor(raw.loaded.image, gray, raw.to_gray);
  }
  if (gray.type() == CV_16UC1) gray = upper_bytes(gray);
  if (gray.type() != CV_8UC1)
    return {ImageStatus::kWrongFormat, place + ": metres are no grey values", {}};
  return {ImageStatus::kOk, {}, {gray.cols, gray.rows, {gray.datastart, gray.dataend}}};
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
