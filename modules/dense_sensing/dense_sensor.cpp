#include "modules/dense_sensing/dense_sensor.hpp"

#include <utility>

#include "modules/core/camera/depth_lookup.hpp"

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
  const ColorImage color = frame.decode_color ? frame.decode_color() : ColorImage{};
  const bool is_gray = color.width != left_.width || color.height != left_.height;
  const auto color_at = [&](std::size_t i) {
    const std::uint8_t gray = frame.left.pixels[i];
    return is_gray ? ColorImage::Pixel{gray, gray, gray} : color.pixels[i];
  };
  ColorImage result{camera().width, camera().height, {}};
  if (stereo_)
    result.pixels = stereo_->rectification().rectified(color_at);
  else
    for (std::size_t i = 0; i < frame.left.pixels.size(); ++i) result.pixels.push_back(color_at(i));
  images.color = std::make_shared<const ColorImage>(std::move(result));
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
  images.labels = labels;
  if (!stereo_) return;
  auto ids = stereo_->rectification().rectified([&](std::size_t i) { return labels->ids[i]; });
  images.labels = std::make_shared<const LabelImage>(
      LabelImage{camera().width, camera().height, std::move(ids)});
}

}  // namespace km
