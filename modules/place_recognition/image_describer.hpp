#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "modules/core/frame.hpp"
#include "modules/core/keyframe.hpp"

namespace km {

/// Describes images by a network in ONNX format, run by OpenCV's dnn module on one thread of the
/// processor. The network may be any that fits: one input of 1 x 1 (grey) or 3 (equal) channels x
/// height x width, and one output of at most kMaxImageDescriptorBytes numbers. Images are resized
/// to the input and have mean 0 and standard deviation 1 there, so that brightness and contrast do
/// not matter. The numbers are scaled to the range of a byte, because only their direction is
/// compared. Not thread-safe.
class ImageDescriber {
 public:
  /// Reads the network and runs it once. Throws ConfigError that names the file and the reason if
  /// it cannot be read or does not fit.
  explicit ImageDescriber(const std::filesystem::path& file);
  ~ImageDescriber();
  ImageDescriber(ImageDescriber&&) noexcept;
  ImageDescriber& operator=(ImageDescriber&&) noexcept;

  /// Identity of the network: 64-bit FNV-1a of the file, never 0.
  [[nodiscard]] std::uint64_t network() const;

  /// Descriptor of an image. An image of one grey level, or an output that is not finite or zero,
  /// gives none (no values).
  [[nodiscard]] ImageDescriptor describe(const GrayImage& image);

 private:
  struct State;  // hides OpenCV's dnn from this header
  std::unique_ptr<State> state_;
};

}  // namespace km
