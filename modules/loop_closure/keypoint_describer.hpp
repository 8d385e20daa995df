#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "modules/core/data/keyframe.hpp"

namespace km {

/// Describes keypoints by a network in ONNX format, run by OpenCV's dnn module on one thread of the
/// processor. Its only input is n x 1 x kPatchSide x kPatchSide: patches of keypoint_patches() with
/// mean 0 and standard deviation 1. Its output has kMatchedNumbers for each patch (see
/// descriptor_of_numbers()). Not thread-safe.
class KeypointDescriber {
 public:
  /// Reads the network and runs it once. Throws ConfigError that names the file and the reason if
  /// it cannot be read or does not fit.
  explicit KeypointDescriber(const std::filesystem::path& file);
  ~KeypointDescriber();
  KeypointDescriber(KeypointDescriber&&) noexcept;
  KeypointDescriber& operator=(KeypointDescriber&&) noexcept;

  /// Identity of the network: 16 bits of its file's fingerprint, never 0.
  [[nodiscard]] std::uint16_t network() const;

  /// Descriptors of corners of `image` (grey), in their order. A patch of one grey level is an
  /// input of zeros. An output that is not finite gives zeros.
  [[nodiscard]] std::vector<MatchedDescriptor> describe(const cv::Mat& image,
                                                        std::span<const cv::KeyPoint> corners);

 private:
  struct State;  // hides OpenCV's dnn from this header
  std::unique_ptr<State> state_;
};

}  // namespace km
