#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/dense_sensing/segmentation_network.hpp"
#include "modules/dense_sensing/stereo_depth.hpp"

namespace km {

/// Where the depth of all pixels comes from.
enum class DepthFrom {
  kImages,  ///< The depth images of the frames.
  kStereo,  ///< Matching left and right images.
};

/// Where the labels of all pixels come from.
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

/// What kept a frame from giving depth.
enum class DenseProblem {
  kNone,
  kNoDepthImage,  ///< This frame has none; they may come at a lower rate.
  kWrongSize,     ///< An image is missing or has not its camera's size.
};

/// Depth and labels of one frame, both seen by DenseSensor::camera().
struct [[nodiscard]] DenseImages {
  DenseProblem problem = DenseProblem::kNone;
  std::shared_ptr<const DepthImage> depth;   ///< Null if there is a problem.
  std::shared_ptr<const LabelImage> labels;  ///< Null: none.
  bool wrong_label_size = false;             ///< Labels not of the left camera's size: left out.
  std::size_t classes_outside = 0;           ///< Of the network, see Segmentation.
};

/// Turns what a robot's cameras saw into depth and labels of every pixel of one camera. Not
/// thread-safe.
class DenseSensor {
 public:
  /// Throws ConfigError and std::invalid_argument as StereoDepth and SegmentationNetwork do.
  DenseSensor(const StereoRig& rig, const DenseSensorConfig& config);

  /// The left camera, or, with stereo matching, an ideal one in its place.
  [[nodiscard]] const Camera& camera() const { return stereo_ ? stereo_->camera() : left_; }

  DenseImages sense(const StereoFrame& frame);

 private:
  void add_depth(const StereoFrame& frame, DenseImages& images);
  void add_labels(const StereoFrame& frame, DenseImages& images);

  Camera left_, right_;
  LabelsFrom labels_;
  std::optional<StereoDepth> stereo_;
  std::optional<SegmentationNetwork> network_;
};

/// What became of the frames that were due for the map, so far.
struct DenseSensingProgress {
  std::uint64_t frames = 0;            ///< Handed on, with depth.
  std::uint64_t gave_way = 0;          ///< Left out because processors were short.
  std::uint64_t without_depth = 0;     ///< Without a depth image: the next frame was taken.
  std::uint64_t wrong_size = 0;        ///< Images missing, or not of their camera's size.
  std::uint64_t without_labels = 0;    ///< Handed on without labels that were wanted.
  std::uint64_t wrong_label_size = 0;  ///< Of these, with labels of the wrong size.
  std::uint64_t classes_outside = 0;   ///< Pixels of classes that the label map lacks.
};

}  // namespace km
