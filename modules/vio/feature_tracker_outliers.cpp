#include <utility>

#include "modules/vio/distance_grid.hpp"
#include "modules/vio/feature_tracker.hpp"
#include "modules/vio/stereo_motion.hpp"
#include "modules/vio/two_point_ransac.hpp"

// The tests by which FeatureTracker drops features.

namespace km {
namespace {

constexpr float kMinSpacing = 0.4F;  // Of min_distance_px: tracks may come nearer than corners.

}  // namespace

void FeatureTracker::drop_crowded(std::vector<Step>& steps) {
  const float spacing = kMinSpacing * static_cast<float>(config_.min_distance_px);
  DistanceGrid grid(cv::Size(rig_.cameras[0].width, rig_.cameras[0].height), spacing);
  statistics_.crowded += static_cast<int>(std::erase_if(steps, [&grid](const Step& step) {
    if (!grid.is_free(step.now.px)) return true;  // The older of two came first.
    grid.add(step.now.px);
    return false;
  }));
}

std::optional<SE3> FeatureTracker::drop_outliers(std::vector<Step>& steps, const SE3& guess) {
  std::vector<DepthPair> pairs;
  for (const Step& step : steps) {
    if (step.depth_before) pairs.push_back(step.depth_pair());
  }
  constexpr double kNoisePx = 1.0;
  const std::optional<SE3> motion = estimate_motion(pairs, guess, kNoisePx / focal_px_, rng_);
  if (motion) {
    drop_by_motion(steps, *motion);
  } else {
    drop_by_two_points(steps, guess);
  }
  return motion;
}

void FeatureTracker::drop_by_motion(std::vector<Step>& steps, const SE3& T_previous_current) {
  const double threshold = config_.max_reprojection_px / focal_px_;
  const auto disagrees = [&](Step& step) {
    if (step.depth_before) {
      const DepthPair pair = step.depth_pair();
      if (reprojection_distance(pair, T_previous_current) < threshold) {
        step.now.inverse_depth = pair.inverse_depth / transfer(pair, T_previous_current).z();
        return false;
      }
    }
    // Without a depth, or with a wrong one, the landmark still lies on its epipolar line.
    return epipolar_distance({step.left_before, step.now.left}, T_previous_current.linear(),
                             T_previous_current.translation()) >= threshold;
  };
  std::vector<Step> kept;
  for (Step& step : steps) {
    if (!disagrees(step)) kept.push_back(std::move(step));
  }
  statistics_.motion = static_cast<int>(steps.size() - kept.size());
  steps = std::move(kept);
}

void FeatureTracker::drop_by_two_points(std::vector<Step>& steps, const SE3& guess) {
  std::vector<BearingPair> pairs;
  for (const Step& step : steps) pairs.push_back({step.left_before, step.now.left});
  // Looser: here the rotation is the gyroscope's, whose bias alone may be worth two pixels.
  const double threshold = 2.0 * config_.max_reprojection_px / focal_px_;
  const TwoPointResult result = two_point_ransac(pairs, guess.linear(), threshold, rng_);
  std::vector<Step> kept;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (!result.inlier[i]) continue;
    steps[i].now.inverse_depth = steps[i].depth_before;
    kept.push_back(std::move(steps[i]));
  }
  statistics_.motion = static_cast<int>(steps.size() - kept.size());
  steps = std::move(kept);
}

}  // namespace km
