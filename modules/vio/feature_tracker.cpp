#include "modules/vio/feature_tracker.hpp"

#include <algorithm>
#include <iterator>
#include <opencv2/video/tracking.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/core/camera/depth_lookup.hpp"

namespace km {
namespace {

constexpr float kMinPatchCorrelation = 0.85F;  // Least correlation of a track with its patch.
constexpr float kMaxCorrectionPx = 2.0F;       // Largest correction of KLT by the patch.
constexpr double kMinDepthRatio = 0.1;         // Below it a point is nearly behind the camera.
constexpr int kSearchEvery = 4;  // A feature without a depth is searched in every fourth image.
constexpr double kMaxInverseDepth = 20.0;  // [1/m]; a propagated depth beyond it is discarded.
constexpr float kMinSpacing = 0.4F;        // Share of min_distance_px to which tracks may approach.
constexpr unsigned kSeed = 1;              // Seed of the random samples.
// Largest distance to which a feature tracked forward and back must return.
constexpr double kMaxForwardBackwardPx = 1.0;

// Pyramid levels above the full image, and largest distance of a feature from the position that the
// common motion predicts. Without a gyroscope features may move by half a window on the coarsest
// level. Outliers are rejected earlier, because no inertial sensor contradicts them later.
constexpr int kLevels = 2, kLevelsWithoutGyro = 4;
constexpr double kMaxReprojectionPx = 1.5, kMaxReprojectionWithoutGyroPx = 1.0;
constexpr double kEpipolarShareWithoutGyro = 0.5;

std::vector<cv::Point2f> to_cv(std::span<const Eigen::Vector2f> points) {
  std::vector<cv::Point2f> result;
  result.reserve(points.size());
  for (const Eigen::Vector2f& p : points) result.emplace_back(p.x(), p.y());
  return result;
}

// Positions of points in another image.
struct KltResult {
  std::vector<Eigen::Vector2f> px;  // One for each point; undefined if not found.
  std::vector<bool> found;          // Converged inside the image.
};

// Pyramidal Lucas-Kanade tracking of the windows around `points` of `from` in `to`, started at
// `starts` (Bouguet, "Pyramidal Implementation of the Lucas Kanade Feature Tracker", 2001).
// `levels`: coarsest pyramid level used. `from` needs derivatives.
KltResult track_klt(const ImagePyramid& from, const ImagePyramid& to,
                    std::span<const Eigen::Vector2f> points,
                    std::span<const Eigen::Vector2f> starts, int levels) {
  KltResult result;
  if (points.empty()) return result;
  std::vector<cv::Point2f> there = to_cv(starts);
  std::vector<unsigned char> status;
  constexpr int kMaxSteps = 8;
  constexpr double kStopPx = 0.05;         // AlignmentPatch refines further.
  constexpr double kMinEigenvalue = 1e-4;  // As OpenCV scales it: rejects flat windows.
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kMaxSteps, kStopPx);
  cv::calcOpticalFlowPyrLK(from.maps(), to.maps(), to_cv(points), there, status, cv::noArray(),
                           cv::Size(ImagePyramid::kWindow_px, ImagePyramid::kWindow_px), levels,
                           stop, cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  const cv::Size size = to.level(0).size();
  for (std::size_t i = 0; i < there.size(); ++i) {
    const bool inside = there[i].x >= 0.0F && there[i].y >= 0.0F &&
                        there[i].x <= static_cast<float>(size.width - 1) &&
                        there[i].y <= static_cast<float>(size.height - 1);
    result.px.emplace_back(there[i].x, there[i].y);
    result.found.push_back(status[i] != 0 && inside);
  }
  return result;
}

TrackerConfig without_gyro(TrackerConfig config) {
  config.max_epipolar_px *= kEpipolarShareWithoutGyro;
  return config;
}

void check_rig(const StereoRig& rig) {
  for (const Camera& camera : rig.cameras) {
    if (camera.width > 0 && camera.height > 0 && camera.fx > 0.0 && camera.fy > 0.0) continue;
    throw std::invalid_argument("FeatureTracker: a camera of " + std::to_string(camera.width) +
                                " x " + std::to_string(camera.height) + " px with focal lengths " +
                                std::to_string(camera.fx) + ", " + std::to_string(camera.fy));
  }
}

template <typename Image>
void check_image(const Image& image, const Camera& camera, const char* side) {
  if (fits(image, camera)) return;
  throw std::invalid_argument("FeatureTracker::track: the " + std::string(side) + " image is " +
                              std::to_string(image.width) + " x " + std::to_string(image.height) +
                              " px, or not as many as that; its camera has " +
                              std::to_string(camera.width) + " x " + std::to_string(camera.height));
}

void check_images(const StereoFrame& frame, const StereoRig& rig) {
  check_image(frame.left, rig.cameras[0], "left");
  if (rig.depth_source == DepthSource::kRightImage)
    check_image(frame.right, rig.cameras[1], "right");
  else if (frame.depth != nullptr)
    check_image(*frame.depth, rig.cameras[0], "depth");
}

std::unique_ptr<const AlignmentPatch> cut_patch(const ImagePyramid& image,
                                                const Eigen::Vector2f& px) {
  const auto patch = AlignmentPatch::cut(image.level(0), px);
  return patch ? std::make_unique<const AlignmentPatch>(*patch) : nullptr;
}

}  // namespace

FeatureTracker::FeatureTracker(const StereoRig& rig, const TrackerConfig& config, bool has_gyro)
    : rig_(rig),
      config_(has_gyro ? checked(config) : without_gyro(checked(config))),
      has_gyro_(has_gyro),
      levels_(has_gyro ? kLevels : kLevelsWithoutGyro),
      max_reprojection_px_(has_gyro ? kMaxReprojectionPx : kMaxReprojectionWithoutGyroPx),
      focal_px_(rig.cameras[0].fx),
      detector_(config_),
      stereo_matcher_(rig, config_),
      rng_(kSeed) {
  check_rig(rig);
  if (rig.depth_source == DepthSource::kDepthImage) depth_matcher_.emplace(rig, config_);
}

TrackedFrame FeatureTracker::track(const StereoFrame& frame,
                                   const Eigen::Matrix3d& R_previous_current_body) {
  check_images(frame, rig_);
  if (!R_previous_current_body.allFinite()) {
    throw std::invalid_argument("FeatureTracker::track: the rotation is not finite");
  }
  ImagePyramid left(frame.left, levels_, true);

  statistics_ = {};
  const SE3 guess = predicted_motion(frame.stamp, R_previous_current_body);
  std::vector<Step> steps = follow(left, guess);
  drop_crowded(steps);
  const std::optional<SE3> motion = drop_outliers(steps, guess);
  if (!has_gyro_ && motion) follow_again(left, *motion, steps);
  align(steps, left, motion.value_or(guess));
  const bool is_first = previous_left_.empty();
  const double dt_s = seconds_between(stamp_, frame.stamp);
  velocity_.setZero();
  if (motion && dt_s > 0.0) {
    velocity_ = motion->linear().transpose() * motion->translation() / dt_s;
  }

  tracks_.clear();
  for (Step& step : steps) tracks_.push_back(std::move(step.now));
  statistics_.tracked = static_cast<int>(tracks_.size());
  add_corners(left);
  match_right(left, frame);
  previous_left_ = std::move(left);
  stamp_ = frame.stamp;
  TrackedFrame result = output();
  if (!is_first && dt_s > 0.0) unroll(motion.value_or(guess), dt_s, result);
  result.T_previous_current = motion;
  return result;
}

SE3 FeatureTracker::predicted_motion(Stamp stamp, const Eigen::Matrix3d& R_body) const {
  const Eigen::Matrix3d R_body_cam = rig_.cameras[0].T_body_cam.linear();
  const double dt_s = previous_left_.empty() ? 0.0 : seconds_between(stamp_, stamp);
  return make_pose(R_body_cam.transpose() * R_body * R_body_cam, velocity_ * dt_s);
}

double FeatureTracker::depth_guess(const Track& track) const {
  if (track.inverse_depth) return *track.inverse_depth;
  constexpr float kReachPx = 80.0F;
  float nearest = kReachPx * kReachPx;
  double guess = 0.0;
  for (const Track& other : tracks_) {
    const float distance = (other.px - track.px).squaredNorm();
    if (!other.inverse_depth || distance >= nearest) continue;
    nearest = distance;
    guess = *other.inverse_depth;
  }
  return guess;
}

Eigen::Vector2f FeatureTracker::predicted_px(const Track& track, double inverse_depth,
                                             const SE3& T_previous_current) const {
  const Eigen::Vector3d X = transfer({track.left, inverse_depth, track.left}, T_previous_current);
  if (X.z() < kMinDepthRatio) return track.px;
  const auto px = rig_.cameras[0].project_ray(X);
  return px ? px->cast<float>() : track.px;
}

std::vector<FeatureTracker::Step> FeatureTracker::follow(const ImagePyramid& left,
                                                         const SE3& guess) {
  std::vector<Step> steps;
  if (tracks_.empty()) return steps;
  std::vector<double> depths;
  std::vector<Eigen::Vector2f> from;
  std::vector<Eigen::Vector2f> starts;
  for (const Track& track : tracks_) {
    depths.push_back(depth_guess(track));
    from.push_back(track.px);
    starts.push_back(predicted_px(track, depths.back(), guess));
  }
  const KltResult there = track_klt(previous_left_, left, from, starts, levels_);
  const KltResult back = track_klt(left, previous_left_, there.px, from, 0);
  std::vector<Track> failed;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const auto bearing =
        there.found[i] ? rig_.cameras[0].unproject(there.px[i].cast<double>()) : std::nullopt;
    if (!bearing || !back.found[i] || !((back.px[i] - from[i]).norm() < kMaxForwardBackwardPx)) {
      failed.push_back(std::move(tracks_[i]));
      continue;
    }
    Step step{std::move(tracks_[i]), {}, {}, depths[i]};
    step.left_before = step.now.left;
    step.depth_before = step.now.inverse_depth;
    ++step.now.length;
    step.now.px = there.px[i];
    step.now.left = *bearing;
    step.now.right.reset();
    step.now.inverse_depth.reset();
    steps.push_back(std::move(step));
  }
  statistics_.lost = static_cast<int>(failed.size());
  tracks_ = std::move(failed);
  return steps;
}

void FeatureTracker::follow_again(const ImagePyramid& left, const SE3& motion,
                                  std::vector<Step>& steps) {
  std::vector<Step> found = follow(left, motion);
  drop_by_motion(found, motion);
  std::ranges::move(found, std::back_inserter(steps));
  std::ranges::sort(steps, {}, [](const Step& step) { return step.now.id; });
  drop_crowded(steps);
}

void FeatureTracker::align(std::vector<Step>& steps, const ImagePyramid& left,
                           const SE3& T_previous_current) const {
  const SE3 T_current_previous = T_previous_current.inverse();
  for (Step& step : steps) {
    Track& track = step.now;
    track.A = local_warp(rig_.cameras[0], rig_.cameras[0], step.left_before, step.depth_guess,
                         T_current_previous) *
              track.A;
    if (track.patch && place_on_patch(track, left)) continue;
    // The patch has changed too much or is half hidden: a new patch starts at the position from
    // KLT.
    track.patch = cut_patch(left, track.px);
    track.A.setIdentity();
  }
}

bool FeatureTracker::place_on_patch(Track& track, const ImagePyramid& left) const {
  const auto found = track.patch->align(left.level(0), track.px, track.A);
  if (!found || !(found->correlation >= kMinPatchCorrelation) ||
      !((found->px - track.px).norm() <= kMaxCorrectionPx))
    return false;
  const auto bearing = rig_.cameras[0].unproject(found->px.cast<double>());
  if (!bearing) return false;
  track.px = found->px;
  track.left = *bearing;
  return true;
}

void FeatureTracker::add_corners(const ImagePyramid& left) {
  std::vector<Eigen::Vector2f> occupied;
  for (const Track& track : tracks_) occupied.push_back(track.px);
  const int wanted = config_.max_features - static_cast<int>(tracks_.size());
  for (const Eigen::Vector2f& px : detector_.detect(left, occupied, wanted)) {
    const std::optional<Eigen::Vector2d> bearing = rig_.cameras[0].unproject(px.cast<double>());
    if (!bearing) continue;
    Track track;
    track.id = next_id_++;
    track.px = px;
    track.left = *bearing;
    track.patch = cut_patch(left, px);
    tracks_.push_back(std::move(track));
  }
}

void FeatureTracker::match_right(const ImagePyramid& left, const StereoFrame& frame) {
  std::vector<StereoQuery> queries;
  std::vector<Track*> asked;
  for (Track& track : tracks_) {
    const bool search = !depth_matcher_ && !track.inverse_depth;  // slow
    if (search && (track.length - 1) % kSearchEvery != 0) continue;
    queries.push_back({track.px, track.left, track.inverse_depth});
    asked.push_back(&track);
  }
  const auto matches =
      depth_matcher_
          ? depth_matcher_->match(frame.depth.get(), queries)
          : stereo_matcher_.match(left, ImagePyramid(frame.right, levels_, false), queries);
  const double threshold = max_reprojection_px_ / focal_px_;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    Track& track = *asked[i];
    if (!matches[i]) {
      if (!(track.inverse_depth <= kMaxInverseDepth)) track.inverse_depth.reset();
      continue;
    }
    if (track.inverse_depth) {
      const Eigen::Vector2d expected =
          stereo_matcher_.right_bearing(track.left, *track.inverse_depth);
      if (!((expected - matches[i]->right).norm() <= threshold)) {
        // One of the two depths is wrong: both are discarded, and a later image searches again.
        track.inverse_depth.reset();
        continue;
      }
    }
    track.right = matches[i]->right;
    track.inverse_depth = matches[i]->inverse_depth;
  }
}

TrackedFrame FeatureTracker::output() const {
  TrackedFrame result;
  result.stamp = stamp_;
  for (const Track& track : tracks_) {
    result.features.push_back({track.id, track.left, track.right, track.length});
  }
  return result;
}

// Moves the bearings of a rolling shutter to where they are at the stamp, by the image velocity
// that the motion since the image before gives them. A row is exposed later than the middle row by
// its share of the readout time.
void FeatureTracker::unroll(const SE3& T_previous_current, double dt_s, TrackedFrame& frame) const {
  const SE3 T_current_previous = T_previous_current.inverse();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const Track& track = tracks_[i];
    TrackedFeature& feature = frame.features[i];
    const Eigen::Vector3d before =
        transfer({track.left, depth_guess(track), track.left}, T_current_previous);
    if (before.z() < kMinDepthRatio) continue;
    const Eigen::Vector2d velocity = (track.left - before.hnormalized()) / dt_s;
    feature.left_by_readout = rig_.cameras[0].row_time(track.px.y()) * velocity;
    feature.left -= config_.readout_s * feature.left_by_readout;
    if (!feature.right) continue;
    const auto px = rig_.cameras[1].project(*feature.right);
    if (!px) continue;
    feature.right_by_readout = rig_.cameras[1].row_time(px->y()) * velocity;
    *feature.right -= config_.readout_s * feature.right_by_readout;
  }
}

void FeatureTracker::drop_crowded(std::vector<Step>& steps) {
  const float spacing = kMinSpacing * static_cast<float>(config_.min_distance_px);
  DistanceGrid grid(cv::Size(rig_.cameras[0].width, rig_.cameras[0].height), spacing);
  std::erase_if(steps, [&grid](const Step& step) {
    if (!grid.is_free(step.now.px)) return true;  // The older track came first.
    grid.add(step.now.px);
    return false;
  });
}

std::optional<SE3> FeatureTracker::drop_outliers(std::vector<Step>& steps, const SE3& guess) {
  std::vector<DepthPair> pairs;
  for (const Step& step : steps) {
    if (step.depth_before) pairs.push_back(step.depth_pair());
  }
  constexpr double kNoisePx = 1.0;
  const auto estimate = has_gyro_ ? estimate_motion : estimate_free_motion;
  const std::optional<SE3> motion = estimate(pairs, guess, kNoisePx / focal_px_, rng_);
  if (motion) {
    drop_by_motion(steps, *motion);
  } else if (has_gyro_) {
    drop_by_two_points(steps, guess);
  } else {  // the wrong features are unknown
    statistics_.motion += static_cast<int>(steps.size());
    steps.clear();
  }
  return motion;
}

void FeatureTracker::drop_by_motion(std::vector<Step>& steps, const SE3& T_previous_current) {
  const double threshold = max_reprojection_px_ / focal_px_;
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
  statistics_.motion += static_cast<int>(steps.size() - kept.size());
  steps = std::move(kept);
}

void FeatureTracker::drop_by_two_points(std::vector<Step>& steps, const SE3& guess) {
  std::vector<BearingPair> pairs;
  for (const Step& step : steps) pairs.push_back({step.left_before, step.now.left});
  // The threshold is doubled because the rotation is the gyroscope's, whose bias alone may shift
  // points by two pixels.
  const double threshold = 2.0 * max_reprojection_px_ / focal_px_;
  const TwoPointResult result = two_point_ransac(pairs, guess.linear(), threshold, rng_);
  std::vector<Step> kept;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (!result.inlier[i]) continue;
    steps[i].now.inverse_depth = steps[i].depth_before;
    kept.push_back(std::move(steps[i]));
  }
  statistics_.motion += static_cast<int>(steps.size() - kept.size());
  steps = std::move(kept);
}

}  // namespace km
