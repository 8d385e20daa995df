#include "modules/place_recognition/image_describer.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "modules/images/configured_network.hpp"
#include "modules/images/network.hpp"

namespace km {
namespace {

constexpr int kMaxInput_px = 4096;
constexpr double kLeastDeviation = 0.5;  // [grey levels] below it the image shows nothing
constexpr float kLargestByte = 127.0F;

constexpr NetworkKey kKey{"place_recognition.network", "networks/places.onnx"};

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
  ConfiguredNetwork network;
  cv::dnn::MatShape input;

  explicit State(const std::filesystem::path& file)
      : network(file, kKey), input(network.input_shape()) {
    if (!is_usable_input(input))
      network.refuse("its input is " + shape_text(input) + ", not 1 x 1 or 3 x height x width");
    const std::size_t numbers = run_once();
    if (numbers < 1 || numbers > kMaxImageDescriptorBytes)
      network.refuse("its output has " + std::to_string(numbers) + " numbers, not 1 to " +
                     std::to_string(kMaxImageDescriptorBytes));
  }

  // Numbers of the output; 0 if they are no floats in sequence.
  std::size_t run_once() {
    try {
      const cv::Mat output = run(cv::Mat::zeros(input[2], input[3], CV_32F));
      return output.depth() == CV_32F && output.isContinuous() ? output.total() : 0;
    } catch (const cv::Exception& error) {
      network.refuse("cannot be run as ONNX: " + reason_of(error));
    }
  }

  cv::Mat run(const cv::Mat& plane) {
    if (input[1] == 1) return network.run(cv::dnn::blobFromImage(plane));
    cv::Mat colors;
    cv::merge(std::vector<cv::Mat>(3, plane), colors);
    return network.run(cv::dnn::blobFromImage(colors));
  }
};

ImageDescriber::ImageDescriber(const std::filesystem::path& file)
    : state_(std::make_unique<State>(file)) {}

ImageDescriber::~ImageDescriber() = default;
ImageDescriber::ImageDescriber(ImageDescriber&&) noexcept = default;
ImageDescriber& ImageDescriber::operator=(ImageDescriber&&) noexcept = default;

std::uint64_t ImageDescriber::network() const {
  return state_->network.fingerprint();
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
  return {.network = network(), .values = std::move(values)};
}

}  // namespace km
