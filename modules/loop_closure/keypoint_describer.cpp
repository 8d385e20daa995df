#include "modules/loop_closure/keypoint_describer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "modules/images/configured_network.hpp"
#include "modules/images/keypoint_patches.hpp"
#include "modules/loop_closure/matching.hpp"

namespace km {
namespace {

constexpr NetworkKey kKey{"keyframe_features.network",
                          "use networks/keypoints.onnx, which comes with the program, or leave "
                          "keyframe_features.network empty"};
constexpr int kSamples = kPatchSide * kPatchSide;
constexpr int kNumbers = kMatchedNumbers;

// Patches of one run. With a constant number OpenCV prepares the network once. More patches do not
// fit into the processor's caches.
constexpr int kBatch = 64;

// Writes the patch with mean 0 and deviation 1. A lower deviation than one grey level is noise.
void normalize(const std::uint8_t* patch, float* result) {
  int sum = 0, squares = 0;
  for (int i = 0; i < kSamples; ++i) {
    sum += patch[i];
    squares += patch[i] * patch[i];
  }
  const double mean = static_cast<double>(sum) / kSamples;
  const double variance = static_cast<double>(squares) / kSamples - mean * mean;
  const auto offset = static_cast<float>(mean);
  const auto factor = static_cast<float>(1.0 / std::sqrt(std::max(variance, 1.0)));
  for (int i = 0; i < kSamples; ++i) result[i] = factor * (static_cast<float>(patch[i]) - offset);
}

MatchedDescriptor descriptor_of(std::span<const float> numbers) {
  if (!std::ranges::all_of(numbers, [](float x) { return std::isfinite(x); }))
    return descriptor_of_numbers(std::array<float, kMatchedNumbers>{});
  return descriptor_of_numbers(numbers);
}

}  // namespace

struct KeypointDescriber::State {
  ConfiguredNetwork network;
  cv::Mat blob;

  explicit State(const std::filesystem::path& file) : network(file, kKey) {
    const int sizes[] = {kBatch, 1, kPatchSide, kPatchSide};
    blob = cv::Mat::zeros(4, sizes, CV_32F);
    const cv::dnn::MatShape& input = network.input_shape();
    if (input.size() != 4 || input[1] != 1 || input[2] != kPatchSide || input[3] != kPatchSide)
      network.refuse("its input is " + shape_text(input) + ", not n x 1 x " +
                     std::to_string(kPatchSide) + " x " + std::to_string(kPatchSide));
    const std::size_t numbers = run_once();
    if (numbers != std::size_t{kBatch} * kNumbers)
      network.refuse("its output has " + std::to_string(numbers) + " numbers for " +
                     std::to_string(kBatch) + " patches, not " + std::to_string(kNumbers) +
                     " each");
  }

  // Numbers of the output; 0 if they are no floats in sequence.
  std::size_t run_once() {
    try {
      const cv::Mat output = network.run(blob);
      return output.depth() == CV_32F && output.isContinuous() ? output.total() : 0;
    } catch (const cv::Exception& error) {
      network.refuse("cannot be run as ONNX: " + reason_of(error));
    }
  }
};

KeypointDescriber::KeypointDescriber(const std::filesystem::path& file)
    : state_(std::make_unique<State>(file)) {}

KeypointDescriber::~KeypointDescriber() = default;
KeypointDescriber::KeypointDescriber(KeypointDescriber&&) noexcept = default;
KeypointDescriber& KeypointDescriber::operator=(KeypointDescriber&&) noexcept = default;

std::uint16_t KeypointDescriber::network() const {
  return std::max<std::uint16_t>(1, static_cast<std::uint16_t>(state_->network.fingerprint()));
}

std::vector<MatchedDescriptor> KeypointDescriber::describe(const cv::Mat& image,
                                                           std::span<const cv::KeyPoint> corners) {
  const cv::Mat patches = keypoint_patches(image, corners);
  std::vector<MatchedDescriptor> descriptors;
  descriptors.reserve(corners.size());
  for (int first = 0; first < patches.rows; first += kBatch) {
    const int count = std::min(kBatch, patches.rows - first);
    for (int i = 0; i < count; ++i)
      normalize(patches.ptr(first + i), state_->blob.ptr<float>() + i * kSamples);
    const cv::Mat numbers = state_->network.run(state_->blob);
    for (int i = 0; i < count; ++i)
      descriptors.push_back(descriptor_of({numbers.ptr<float>() + i * kNumbers, kMatchedNumbers}));
  }
  return descriptors;
}

}  // namespace km
