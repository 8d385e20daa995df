#include "modules/loop_closure/keyframe_features.hpp"

#include <Eigen/Geometry>
#include <stdexcept>
#include <utility>

#include "modules/core/camera/depth_lookup.hpp"
#include "modules/images/image_view.hpp"
#include "modules/images/spread_keypoints.hpp"

namespace km {

KeyframeFeatureExtractor::KeyframeFeatureExtractor(const StereoRig& rig,
                                                   const KeyframeFeaturesConfig& config,
                                                   std::optional<KeypointDescriber> describer)
    : config_(checked(config)), rig_(rig), describer_(std::move(describer)) {
  if (rig.depth_source == DepthSource::kRightImage) stereo_.emplace(rig, config);
}

KeyframeFeatures KeyframeFeatureExtractor::extract(const StereoFrame& frame) {
  if (!fits(frame, rig_))
    throw std::invalid_argument("KeyframeFeatureExtractor: images of another size than the rig's");
  const SpreadKeypoints spread =
      spread_keypoints(view(frame.left), config_.max_keypoints, config_.min_contrast);

  KeyframeFeatures features;
  features.T_body_cam = rig_.cameras[0].T_body_cam;
  features.depth_source = rig_.depth_source;
  features.focal_px = 0.5 * (rig_.cameras[0].fx + rig_.cameras[0].fy);
  features.baseline_m = rig_.baseline_m();
  std::vector<MatchedDescriptor> by_network;
  if (describer_) {
    features.network = describer_->network();
    by_network = describer_->describe(view(frame.left), spread.corners);
  }
  std::vector<Eigen::Vector2f> pixels, bearings;
  for (std::size_t i = 0; i < spread.corners.size(); ++i) {
    const cv::KeyPoint& corner = spread.corners[i];
    const std::optional<Eigen::Vector2d> bearing =
        rig_.cameras[0].unproject({corner.pt.x, corner.pt.y});
    if (!bearing) continue;
    pixels.emplace_back(corner.pt.x, corner.pt.y);
    bearings.push_back(bearing->cast<float>());
    features.keypoints.push_back({.bearing = bearings.back(),
                                  .inverse_depth = 0.0F,
                                  .octave = static_cast<std::uint8_t>(corner.octave)});
    features.descriptors.push_back(spread.descriptors[i]);
    if (describer_) features.matched.push_back(by_network[i]);
  }
  const std::vector<float> depths = inverse_depths(frame, pixels, bearings);
  for (std::size_t i = 0; i < depths.size(); ++i) features.keypoints[i].inverse_depth = depths[i];
  return features;
}

std::vector<float> KeyframeFeatureExtractor::inverse_depths(
    const StereoFrame& frame, std::span<const Eigen::Vector2f> pixels,
    std::span<const Eigen::Vector2f> bearings) const {
  if (stereo_) return stereo_->inverse_depths(frame, bearings);
  std::vector<float> result(pixels.size(), 0.0F);
  if (frame.depth == nullptr) return result;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto inverse_depth =
        inverse_depth_at(*frame.depth, pixels[i].cast<double>(), depth_edge_threshold(rig_));
    if (inverse_depth && *inverse_depth >= 1.0 / config_.max_depth_m &&
        *inverse_depth <= 1.0 / config_.min_depth_m)
      result[i] = static_cast<float>(*inverse_depth);
  }
  return result;
}

void unroll(const Camera& camera, double readout_s, const Vector6& twist_body,
            KeyframeFeatures& features) {
  const SE3& T_body_cam = features.T_body_cam;
  const Eigen::Vector3d rate_body = twist_body.head<3>();
  const Eigen::Vector3d velocity_body =
      twist_body.tail<3>() + rate_body.cross(T_body_cam.translation());
  const Eigen::Vector3d rate = T_body_cam.linear().transpose() * rate_body;
  const Eigen::Vector3d velocity = T_body_cam.linear().transpose() * velocity_body;
  for (Keypoint& keypoint : features.keypoints) {
    const Eigen::Vector2d bearing = keypoint.bearing.cast<double>();
    const auto px = camera.project(bearing);
    if (!px) continue;
    const double late_s = readout_s * camera.row_time(px->y());
    const Eigen::Vector3d u =
        -rate.cross(bearing.homogeneous()) - double{keypoint.inverse_depth} * velocity;
    keypoint.bearing -= (late_s * (u.head<2>() - u.z() * bearing)).cast<float>();
    keypoint.inverse_depth *= static_cast<float>(1.0 + late_s * u.z());
  }
}

KeyframeFeatures selected(const KeyframeFeatures& features, std::span<const std::size_t> places) {
  KeyframeFeatures result = features;
  const auto select = [&](auto& values) {
    if (values.empty()) return;
    const auto all = std::exchange(values, {});
    values.reserve(places.size());
    for (const std::size_t i : places) values.push_back(all[i]);
  };
  select(result.keypoints);
  select(result.descriptors);
  select(result.matched);
  return result;
}

KeyframeFeatures reduced(const KeyframeFeatures& features, std::size_t count) {
  if (features.keypoints.size() <= count) return features;
  std::vector<std::size_t> places;
  for (const bool with_depth : {true, false})
    for (std::size_t i = 0; i < features.keypoints.size() && places.size() < count; ++i)
      if (features.keypoints[i].has_depth() == with_depth) places.push_back(i);
  return selected(features, places);
}

}  // namespace km
