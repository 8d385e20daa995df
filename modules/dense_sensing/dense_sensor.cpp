#include "modules/dense_sensing/dense_sensor.hpp"

#include <utility>

#include "modules/core/depth_lookup.hpp"

namespace km {
namespace {

bool fits(const LabelImage& labels, const Camera& camera) {
  return labels.width == camera.width && labels.height == camera.height &&
         labels.ids.size() ==
             static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

}  // namespace

DenseSensor::DenseSensor(const StereoRig& rig, const DenseSensorConfig& config)
    : left_(rig.cameras[0]), right_(rig.cameras[1]), labels_(config.labels) {
  if (config.depth == DepthFrom::kStereo) stereo_.emplace(rig, config.stereo);
  if (labels_ == LabelsFrom::kNetwork) network_.emplace(config.segmentation);
}

DenseImages DenseSensor::sense(const StereoFrame& frame) {
  DenseImages images;
  add_depth(frame, images);
  if (images.problem != DenseProblem::kNone) return images;
  add_labels(frame, images);
  add_color(frame, images);
  return images;
}

void DenseSensor::add_depth(const StereoFrame& frame, DenseImages& images) {
  if (stereo_) {
    if (fits(frame.left, left_) && fits(frame.right, right_))
      images.depth = std::make_shared<const DepthImage>(stereo_->compute(frame.left, frame.right));
    else
      images.problem = DenseProblem::kWrongSize;
  } else if (frame.depth == nullptr) {
    images.problem = DenseProblem::kNoDepthImage;
  } else if (!fits(*frame.depth, left_)) {
    images.problem = DenseProblem::kWrongSize;
  } else {
    images.depth = frame.depth;
  }
}

void DenseSensor::add_color(const StereoFrame& frame, DenseImages& images) const {
  if (!fits(frame.left, left_)) return;
  ColorImage gray{frame.left.width, frame.left.height, {}};
  gray.pixels.reserve(frame.left.pixels.size());
  for (const std::uint8_t value : frame.left.pixels) gray.pixels.push_back({value, value, value});
  images.color = std::make_shared<const ColorImage>(
      stereo_ ? stereo_->rectification().rectified(gray) : std::move(gray));
}

void DenseSensor::add_labels(const StereoFrame& frame, DenseImages& images) {
  std::shared_ptr<const LabelImage> labels;
  if (labels_ == LabelsFrom::kImages) labels = frame.labels;
  if (labels_ == LabelsFrom::kNetwork && fits(frame.left, left_)) {
    Segmentation segmentation = network_->segment(frame.left);
    images.unmapped_pixels = segmentation.unmapped_pixels;
    labels = std::make_shared<const LabelImage>(std::move(segmentation.labels));
  }
  if (labels == nullptr) return;
  images.wrong_label_size = !fits(*labels, left_);
  if (images.wrong_label_size) return;
  images.labels =
      stereo_ ? std::make_shared<const LabelImage>(stereo_->rectification().rectified(*labels))
              : labels;
}

}  // namespace km
