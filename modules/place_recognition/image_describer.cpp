#include "modules/place_recognition/image_describer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/bytes.hpp"
#include "modules/core/config.hpp"
#include "modules/core/input_file.hpp"
#include "modules/images/network.hpp"

namespace km {
namespace {

constexpr int kMaxInput_px = 4096;
constexpr double kLeastDeviation = 0.5;  // [grey levels] below it the image shows nothing
constexpr float kLargestByte = 127.0F;

constexpr const char* kWayOut =
    "; use networks/places.onnx, which comes with the program, or leave "
    "place_recognition.network empty";

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& reason) {
  throw ConfigError("place_recognition.network: " + file.string() + ": " + reason + kWayOut + "\n");
}

using Bytes = std::span<const std::uint8_t>;

// The values of field `wanted` of a protobuf message (protobuf.dev: encoding). A number is its
// value and has no bytes; a message or text is its bytes. Ends at the first byte that is none of
// these.
std::vector<std::pair<std::uint64_t, Bytes>> values_of(Bytes message, std::uint64_t wanted) {
  constexpr std::uint64_t kVarint = 0, k64Bits = 1, kBytes = 2, k32Bits = 5;  // wire types
  std::vector<std::pair<std::uint64_t, Bytes>> values;
  ByteReader in(message);
  while (in.left() > 0) {
    const std::uint64_t tag = in.varint();
    const std::uint64_t kind = tag & 7U;
    const std::uint64_t number = kind == kVarint || kind == kBytes ? in.varint() : 0;
    const std::uint64_t size = kind == kBytes    ? number
                               : kind == k64Bits ? 8
                               : kind == k32Bits ? 4
                                                 : 0;
    const Bytes bytes = in.bytes(size);
    if (in.failed() || kind == 3 || kind == 4 || kind > k32Bits) return {};
    if (tag >> 3U == wanted) values.emplace_back(number, bytes);
  }
  return values;
}

// Shape of the first input of an ONNX file (onnx.proto), which OpenCV reads but does not state.
// Empty if there is none; a size that is not fixed is 0.
cv::dnn::MatShape input_shape(Bytes model) {
  constexpr std::array<std::uint64_t, 5> kPath = {7, 11, 2, 1,
                                                  2};  // graph, input, type, tensor, shape
  for (const std::uint64_t field : kPath) {
    const auto values = values_of(model, field);
    if (values.empty()) return {};
    model = values.front().second;
  }
  cv::dnn::MatShape shape;
  for (const auto& [number, dimension] : values_of(model, 1)) {
    const auto size = values_of(dimension, 1);
    shape.push_back(size.empty() ? 0
                                 : static_cast<int>(std::min<std::uint64_t>(
                                       size.front().first, std::numeric_limits<int>::max())));
  }
  return shape;
}

bool is_usable_input(const cv::dnn::MatShape& shape) {
  return shape.size() == 4 && shape[0] == 1 && (shape[1] == 1 || shape[1] == 3) &&
         std::clamp(shape[2], 1, kMaxInput_px) == shape[2] &&
         std::clamp(shape[3], 1, kMaxInput_px) == shape[3];
}

// The numbers scaled so that the largest is 127; none if they are zero or not finite.
std::vector<std::int8_t> bytes_of(std::span<const float> numbers) {
  float largest = 0.0F;
  for (const float x : numbers) {
    if (!std::isfinite(x)) return {};
    largest = std::max(largest, std::abs(x));
  }
  if (!(largest > 0.0F)) return {};
  std::vector<std::int8_t> bytes;
  for (const float x : numbers)
    bytes.push_back(static_cast<std::int8_t>(std::lround(x / largest * kLargestByte)));
  return bytes;
}

}  // namespace

struct ImageDescriber::State {
  std::uint64_t network = kFnv1aBasis;
  cv::dnn::Net net;
  cv::dnn::MatShape input;

  explicit State(const std::filesystem::path& file) {
    const std::string bytes = read_network(file);
    const Bytes model(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    mix_fnv1a(network, model);
    network = std::max<std::uint64_t>(network, 1);
    try {
      net = read_onnx(bytes);
      input = input_shape(model);
      if (!is_usable_input(input))
        refuse(file, "its input is " + shape_text(input) + ", not 1 x 1 or 3 x height x width");
      const cv::Mat output = run(cv::Mat::zeros(input[2], input[3], CV_32F));
      if (output.depth() != CV_32F || !output.isContinuous() || output.total() < 1 ||
          output.total() > kMaxImageDescriptorBytes)
        refuse(file, "its output has " + std::to_string(output.total()) + " numbers, not 1 to " +
                         std::to_string(kMaxImageDescriptorBytes));
    } catch (const cv::Exception& error) {
      refuse(file, "cannot be run as ONNX: " + reason_of(error));
    }
  }

  static std::string read_network(const std::filesystem::path& file) {
    try {
      return read_input_file(file, kMaxNetworkBytes);
    } catch (const std::runtime_error& error) {
      throw ConfigError("place_recognition.network: " + std::string(error.what()) + kWayOut + "\n");
    }
  }

  cv::Mat run(const cv::Mat& plane) {
    const cv::Mat blob = cv::dnn::blobFromImage(plane);
    if (input[1] == 1) {
      net.setInput(blob);
    } else {
      cv::Mat colors;
      cv::merge(std::vector<cv::Mat>(3, plane), colors);
      net.setInput(cv::dnn::blobFromImage(colors));
    }
    return net.forward();
  }
};

ImageDescriber::ImageDescriber(const std::filesystem::path& file)
    : state_(std::make_unique<State>(file)) {}

ImageDescriber::~ImageDescriber() = default;
ImageDescriber::ImageDescriber(ImageDescriber&&) noexcept = default;
ImageDescriber& ImageDescriber::operator=(ImageDescriber&&) noexcept = default;

std::uint64_t ImageDescriber::network() const {
  return state_->network;
}

ImageDescriptor ImageDescriber::describe(const GrayImage& image) {
  const cv::Size size(state_->input[3], state_->input[2]);
  const cv::Mat input = resized(image, size);
  cv::Mat plane;
  cv::Scalar mean, deviation;
  cv::meanStdDev(input, mean, deviation);
  if (deviation[0] < kLeastDeviation) return {};
  input.convertTo(plane, CV_32F, 1.0 / deviation[0], -mean[0] / deviation[0]);
  const cv::Mat output = state_->run(plane);
  std::vector<std::int8_t> values = bytes_of({output.ptr<float>(), output.total()});
  if (values.empty()) return {};
  return {.network = state_->network, .values = std::move(values)};
}

}  // namespace km
