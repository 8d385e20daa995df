#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/vio/feature_detector.hpp"
#include "modules/vio/image_pyramid.hpp"
#include "modules/vio/patches.hpp"
#include "modules/vio/stereo_matcher.hpp"
#include "modules/vio/track_motion.hpp"
#include "modules/vio/tracked_frame.hpp"
#include "modules/vio/tracker_config.hpp"

namespace km {

/// Counts of the features of the image before. Those too near to another feature are not counted.
struct TrackerStatistics {
  int tracked = 0;  ///< Features continued in this image.
  int lost = 0;     ///< Features that KLT failed to track forward and back, or that left the image.
  int motion = 0;   ///< Features that contradict the motion of the others.
};

/// Tracks corners through a stereo or RGB-D recording. Not thread-safe; starts no threads.
/// Deterministic for equal images and config.
///
/// 1. Corners are tracked from left image to left image by pyramidal KLT (Bouguet 2001). The
///    predicted start uses the gyroscope's rotation, the last translation, and the depth of the
///    feature or of its neighbours.
/// 2. Outliers are rejected against the one motion that most stereo features agree on
///    (estimate_motion()). If too few features agree, two-point RANSAC rejects outliers.
/// 3. The positions are aligned with the patches with which the tracks began, so that errors do not
///    accumulate (AlignmentPatch).
/// 4. New corners are added, first in cells without features.
/// 5. StereoMatcher matches left points to the right image, starting at the depth that the motion
///    predicts. With an RGB-D rig DepthMatcher computes the observations of a virtual right camera.
/// 6. The bearings of a rolling shutter (TrackerConfig::readout_s) are moved to the stamp.
class FeatureTracker {
 public:
  /// `has_gyro`: a gyroscope measures the rotations of track(). Otherwise they are extrapolated,
  /// and the tracker searches over larger distances. Throws ConfigError, and std::invalid_argument
  /// for cameras without size or focal length.
  FeatureTracker(const StereoRig& rig, const TrackerConfig& config, bool has_gyro = true);

  /// The features of `frame`, possibly none. `R_previous_current_body` is the rotation of the body
  /// since the frame before, p_previous = R * p_current; identity if unknown.
  /// Throws std::invalid_argument if the frame does not fit the rig (see fits()) or the rotation is
  /// not finite; the tracker is then unchanged.
  [[nodiscard]] TrackedFrame track(const StereoFrame& frame,
                                   const Eigen::Matrix3d& R_previous_current_body);

  /// Counts of the last track().
  [[nodiscard]] const TrackerStatistics& statistics() const { return statistics_; }

 private:
  struct Track {
    std::uint64_t id = 0;
    int length = 1;
    Eigen::Vector2f px = Eigen::Vector2f::Zero();    // position in the left image
    Eigen::Vector2d left = Eigen::Vector2d::Zero();  // bearings in the left and right camera
    std::optional<Eigen::Vector2d> right;
    // Measured in this image, or propagated by the motion [1/m].
    std::optional<double> inverse_depth;
    // Patch around the feature in the image where the track began, or where a new patch replaced
    // that one; null near the image border or without texture.
    std::unique_ptr<const AlignmentPatch> patch;
    Eigen::Matrix2f A = Eigen::Matrix2f::Identity();  // warp from the patch to this image
  };
  // A track in the new image, with its state in the image before.
  struct Step {
    Track now;
    Eigen::Vector2d left_before = Eigen::Vector2d::Zero();
    std::optional<double> depth_before;  // Inverse depth of this track.
    double depth_guess = 0.0;            // Inverse depth of this track or a neighbour.

    [[nodiscard]] DepthPair depth_pair() const {
      return {left_before, depth_before.value_or(0.0), now.left};
    }
  };

  [[nodiscard]] SE3 predicted_motion(Stamp stamp, const Eigen::Matrix3d& R_body) const;
  [[nodiscard]] double depth_guess(const Track& track) const;
  [[nodiscard]] Eigen::Vector2f predicted_px(const Track& track, double inverse_depth,
                                             const SE3& T_previous_current) const;
  // Steps of the tracks that KLT finds. The other tracks stay in tracks_.
  [[nodiscard]] std::vector<Step> follow(const ImagePyramid& left, const SE3& guess);
  // Searches the tracks that follow() did not find where `motion` predicts them.
  void follow_again(const ImagePyramid& left, const SE3& motion, std::vector<Step>& steps);
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
  void unroll(const SE3& T_previous_current, double dt_s, TrackedFrame& frame) const;

  StereoRig rig_;
  TrackerConfig config_;
  bool has_gyro_;
  int levels_;  // Pyramid levels above the full image.
  double max_reprojection_px_;
  double focal_px_;
  FeatureDetector detector_;
  StereoMatcher stereo_matcher_;
  std::optional<DepthMatcher> depth_matcher_;  // Only with an RGB-D rig.
  std::mt19937 rng_;
  std::uint64_t next_id_ = 0;
  std::vector<Track> tracks_;  // Tracks of the last image, ascending ids.
  ImagePyramid previous_left_;
  Stamp stamp_ = 0;  // Stamp of the last image.
  // Velocity of the left camera, in its frame [m/s].
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  TrackerStatistics statistics_;
};

}  // namespace km
