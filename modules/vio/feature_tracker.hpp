#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/vio/feature_detector.hpp"
#include "modules/vio/image_pyramid.hpp"
#include "modules/vio/patches.hpp"
#include "modules/vio/stereo_matcher.hpp"
#include "modules/vio/track_motion.hpp"
#include "modules/vio/tracked_frame.hpp"
#include "modules/vio/tracker_config.hpp"

namespace km {

/// What happened in the last image: every feature of the image before is tracked or counted under
/// the first test that it failed.
struct TrackerStatistics {
  int tracked = 0;   ///< From the image before.
  int detected = 0;  ///< New.
  int lost = 0;      ///< KLT failed, or left the image.
  int backward = 0;  ///< Forward-backward check.
  int crowded = 0;   ///< Ran into another feature.
  int motion = 0;    ///< Against the motion of the others.
  StereoStatistics stereo;
  int stereo_motion = 0;  ///< Right image points dropped against the motion; the left one stays.
  bool motion_known = false;  ///< The stereo features agreed on a motion.
};

/// Tracks corners through a stereo or RGB-D recording. Not thread-safe, starts no threads of its
/// own; deterministic for equal images and config.
///
/// Left image to left image by pyramidal KLT (Bouguet 2001) from a predicted start: the gyroscope's
/// rotation, the last translation, and the depth of the feature or of its neighbours; then to the
/// patch that the track began with, so that errors do not add up (AlignmentPatch). Outliers are
/// rejected against the one motion that the stereo features agree on (estimate_motion()), by
/// two-point RANSAC where these are too few. Then corners are added where there are none. Left to
/// right by StereoMatcher from the depth that the motion predicts; with an RGB-D rig the right
/// observations are those of the virtual camera, by DepthMatcher.
class FeatureTracker {
 public:
  /// Throws ConfigError, and std::invalid_argument for cameras without size or focal length.
  FeatureTracker(const StereoRig& rig, const TrackerConfig& config);

  /// The features of `frame`, possibly none. `R_previous_current_body` is the rotation of the body
  /// since the frame before, p_previous = R * p_current; identity if it is not known.
  /// Throws std::invalid_argument if the frame does not fit the rig (see fits()) or the rotation is
  /// not finite; the tracker is then unchanged.
  [[nodiscard]] TrackedFrame track(const StereoFrame& frame,
                                   const Eigen::Matrix3d& R_previous_current_body);

  /// Of the last track().
  [[nodiscard]] const TrackerStatistics& statistics() const { return statistics_; }

 private:
  struct Track {
    std::uint64_t id = 0;
    int length = 1;
    Eigen::Vector2f px = Eigen::Vector2f::Zero();    // In the left image.
    Eigen::Vector2d left = Eigen::Vector2d::Zero();  // Bearings.
    std::optional<Eigen::Vector2d> right;
    std::optional<double> inverse_depth;  // Measured here, or carried on by the motion [1/m].
    std::unique_ptr<const AlignmentPatch> patch;  // From where the track began; null at the rim.
    Eigen::Matrix2f A = Eigen::Matrix2f::Identity();  // Patch to this image.
  };
  // A track in the new image, and what was known of it in the image before.
  struct Step {
    Track now;
    Eigen::Vector2d left_before = Eigen::Vector2d::Zero();
    std::optional<double> depth_before;  // Inverse, its own.
    double depth_guess = 0.0;            // Inverse, its own or a neighbour's.

    [[nodiscard]] DepthPair depth_pair() const {
      return {left_before, depth_before.value_or(0.0), now.left};
    }
  };

  [[nodiscard]] SE3 predicted_motion(Stamp stamp, const Eigen::Matrix3d& R_body) const;
  [[nodiscard]] double depth_guess(const Track& track) const;
  [[nodiscard]] Eigen::Vector2f predicted_px(const Track& track, double inverse_depth,
                                             const SE3& T_previous_current) const;
  [[nodiscard]] std::vector<Step> follow(const ImagePyramid& left, const SE3& guess);
  void drop_crowded(std::vector<Step>& steps);
  [[nodiscard]] std::optional<SE3> drop_outliers(std::vector<Step>& steps, const SE3& guess);
  void drop_by_motion(std::vector<Step>& steps, const SE3& T_previous_current);
  void drop_by_two_points(std::vector<Step>& steps, const SE3& guess);
  void align(std::vector<Step>& steps, const ImagePyramid& left,
             const SE3& T_previous_current) const;
  [[nodiscard]] bool place_on_patch(Track& track, const ImagePyramid& left) const;
  void add_corners(const ImagePyramid& left);
  void match_right(const ImagePyramid& left, const StereoFrame& frame);
  [[nodiscard]] TrackedFrame output() const;

  StereoRig rig_;
  TrackerConfig config_;
  double focal_px_;
  FeatureDetector detector_;
  StereoMatcher stereo_matcher_;
  std::optional<DepthMatcher> depth_matcher_;  // With an RGB-D rig.
  std::mt19937 rng_;
  std::uint64_t next_id_ = 0;
  std::vector<Track> tracks_;  // Of the last image, ascending ids.
  ImagePyramid previous_left_;
  Stamp stamp_ = 0;                                     // Of the last image.
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();  // Of the left camera, in its frame [m/s].
  TrackerStatistics statistics_;
};

}  // namespace km
