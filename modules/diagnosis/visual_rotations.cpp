#include "modules/diagnosis/visual_rotations.hpp"

#include <random>

#include "modules/core/lie.hpp"
#include "modules/diagnosis/image_rotation.hpp"
#include "modules/diagnosis/stereo_fit.hpp"
#include "modules/vio/track_motion.hpp"

namespace km {
namespace {

constexpr double kNoise_px = 0.3;  // noise of a tracked corner
constexpr std::size_t kMinDepths = 30;

std::vector<BearingStep> bearings_of(const TrackedStep& step, const Camera& camera) {
  std::vector<BearingStep> bearings;
  for (const TrackedPoint& point : step.points) {
    const auto from = camera.unproject(point.from), to = camera.unproject(point.to);
    if (from && to) bearings.push_back({*from, *to});
  }
  return bearings;
}

std::vector<DepthPair> depths_of(const TrackedStep& step, const StereoRig& rig) {
  std::vector<DepthPair> pairs;
  const SE3 T_right_left = rig.T_left_right().inverse();
  for (const TrackedPoint& point : step.points) {
    if (!point.right) continue;
    const auto to = rig.cameras[0].unproject(point.to);
    const auto seen = stereo_point(rig, T_right_left, {point.from, *point.right});
    if (to && seen && seen->error_px < kEpipolarInlier_px && seen->depth_m > 0.0)
      pairs.push_back({seen->left, 1.0 / seen->depth_m, *to});
  }
  return pairs;
}

}  // namespace

VisualRotations visual_rotations(std::span<const TrackedStep> steps, const StereoRig& rig,
                                 bool use_depth) {
  const Camera& camera = rig.cameras[0];
  const double sigma = kNoise_px / camera.fx;
  std::mt19937 rng(1);
  VisualRotations seen;
  for (const TrackedStep& step : steps) {
    const auto alone = rotation_between(bearings_of(step, camera), sigma);
    if (!alone) continue;
    VisualRotation found{step.from, step.to, alone->rotation};
    const std::vector<DepthPair> depths =
        use_depth ? depths_of(step, rig) : std::vector<DepthPair>();
    if (depths.size() >= kMinDepths) {
      SE3 guess = SE3::Identity();
      guess.linear() = so3_exp(alone->rotation);
      const auto motion = estimate_motion(depths, guess, sigma, rng);
      if (!motion) continue;
      found.rotation = so3_log(motion->linear());
      ++seen.with_depth;
    }
    seen.steps.push_back(found);
  }
  return seen;
}

}  // namespace km
