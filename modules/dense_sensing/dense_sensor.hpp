#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/color_image.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/dense_sensing/segmentation_network.hpp"
#include "modules/dense_sensing/stereo_depth.hpp"

namespace km {

/// Source of the depth of all pixels.
enum class DepthFrom {
  kImages,  ///< The depth images of the frames.
  kStereo,  ///< Matching left and right images.
};

/// Source of the labels of all pixels.
enum class LabelsFrom {
  kNone,
  kImages,   ///< The label images of the frames.
  kNetwork,  ///< A segmentation network on the left images.
};

struct DenseSensorConfig {
  DepthFrom depth = DepthFrom::kImages;
  LabelsFrom labels = LabelsFrom::kNone;
  StereoDepthConfig stereo = {};         ///< With kStereo.
  SegmentationConfig segmentation = {};  ///< With kNetwork.
};

/// Reason why a frame gives no depth.
enum class DenseProblem {
  kNone,
  kNoDepthImage,  ///< The frame has no depth image. Depth images may come at a lower rate.
  kWrongSize,     ///< An image is missing or has another size than its camera.
};

/// Depth and labels of one frame, both seen by DenseSensor::camera().
struct [[nodiscard]] DenseImages {
  DenseProblem problem = DenseProblem::kNone;
  std::shared_ptr<const DepthImage> depth;   ///< Null if there is a problem.
  std::shared_ptr<const LabelImage> labels;  ///< Null without labels.
  std::shared_ptr<const ColorImage> color;   ///< Grey if the camera is. Null if there is a problem.
  bool wrong_label_size = false;    ///< Labels of another size than the left camera's are dropped.
  std::size_t unmapped_pixels = 0;  ///< Pixels of classes that the label map of the network lacks,
                                    ///< see Segmentation.
};

/// Computes depth and labels of every pixel of one camera from a robot's images. Not thread-safe.
class DenseSensor {
 public:
  /// Throws ConfigError and std::invalid_argument under the conditions of StereoDepth and
  /// SegmentationNetwork.
  DenseSensor(const StereoRig& rig, const DenseSensorConfig& config);

  /// The left camera, or, with stereo matching, the ideal camera of StereoDepth::camera().
  [[nodiscard]] const Camera& camera() const { return stereo_ ? stereo_->camera() : left_; }

  DenseImages sense(const StereoFrame& frame);

 private:
  void add_depth(const StereoFrame& frame, DenseImages& images);
  void add_labels(const StereoFrame& frame, DenseImages& images);
  void add_color(const StereoFrame& frame, DenseImages& images) const;

  Camera left_, right_;
  LabelsFrom labels_;
  std::optional<StereoDepth> stereo_;
  std::optional<SegmentationNetwork> network_;
};

/// Counts of the frames that were due for the map, so far.
struct DenseSensingProgress {
  std::uint64_t frames = 0;              ///< Frames published with depth.
  std::uint64_t dropped_under_load = 0;  ///< Frames dropped because processors were too slow.
  std::uint64_t without_depth = 0;       ///< Frames without a depth image; the next one is due.
  std::uint64_t wrong_size = 0;          ///< Frames with DenseProblem::kWrongSize.
  std::uint64_t without_labels = 0;      ///< Frames published without the requested labels.
  std::uint64_t wrong_label_size = 0;    ///< Part of without_labels: labels of the wrong size.
  std::uint64_t unmapped_pixels = 0;     ///< Pixels of classes that the label map lacks.
};

}  // namespace km
