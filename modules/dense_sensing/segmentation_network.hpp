#pragma once

#include <cstddef>
#include <memory>

#include "modules/core/camera/frame.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/dense_sensing/segmentation_config.hpp"

namespace km {

/// Result of a network for one image.
struct Segmentation {
  LabelImage labels;                ///< As large as the image.
  std::size_t unmapped_pixels = 0;  ///< Pixels of a class that the label map lacks: unknown.
};

/// A semantic segmentation network in ONNX format, run by OpenCV's dnn module. Not thread-safe.
class SegmentationNetwork {
 public:
  /// Reads the network and runs it once. Throws ConfigError with the reason if `config` is out of
  /// bounds, the file cannot be used, or the output is not an image of classes.
  explicit SegmentationNetwork(const SegmentationConfig& config);
  ~SegmentationNetwork();
  SegmentationNetwork(SegmentationNetwork&&) noexcept;
  SegmentationNetwork& operator=(SegmentationNetwork&&) noexcept;

  /// The class of every pixel as its label, taken from the nearest pixel of the network's output.
  [[nodiscard]] Segmentation segment(const GrayImage& image);

 private:
  struct State;  // hides OpenCV's dnn from this header
  std::unique_ptr<State> state_;
};

}  // namespace km
