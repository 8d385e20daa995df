#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "modules/core/frame.hpp"
#include "modules/core/label_palette.hpp"
#include "modules/dense_sensing/segmentation_config.hpp"

namespace km {

/// What a network made of an image.
struct Segmentation {
  LabelImage labels;                ///< As large as the image.
  std::size_t classes_outside = 0;  ///< Pixels of a class that the label map lacks: unknown.
};

/// A semantic segmentation network in ONNX format, run by OpenCV's dnn module. Not thread-safe.
class SegmentationNetwork {
 public:
  /// Reads the network and runs it once. Throws ConfigError, with the reason, if `config` is out of
  /// bounds, the file cannot be used, or what comes out is no image of classes.
  explicit SegmentationNetwork(const SegmentationConfig& config);
  ~SegmentationNetwork();
  SegmentationNetwork(SegmentationNetwork&&) noexcept;
  SegmentationNetwork& operator=(SegmentationNetwork&&) noexcept;

  /// The class of every pixel as its label: that of the nearest pixel of the network's output.
  [[nodiscard]] Segmentation segment(const GrayImage& image);

 private:
  struct State;  // keeps OpenCV's dnn out of this header
  std::unique_ptr<State> state_;
};

}  // namespace km
