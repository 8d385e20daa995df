#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/frame.hpp"
#include "modules/vio/image_pyramid.hpp"
#include "modules/vio/tracker_config.hpp"

namespace km {

/// A point of the left image to be found in the right one.
struct StereoQuery {
  Eigen::Vector2f left_px = Eigen::Vector2f::Zero();
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< Its bearing, undistorted.
  std::optional<double> inverse_depth;             ///< Expected 1/z in the left camera [1/m].
};

/// Where a query was found.
struct StereoMatch {
  Eigen::Vector2d right = Eigen::Vector2d::Zero();  ///< Bearing in the right camera.
  double inverse_depth = 0.0;  ///< 1/z in the left camera [1/m]; not negative, 0 is infinity.
};

/// What became of the queries of one image.
struct StereoStatistics {
  int matched = 0;
  int no_start = 0;    ///< No similar patch along the epipolar line, or several alike.
  int dissimilar = 0;  ///< The patches differ too much, or lie at a rim.
  int epipolar = 0;    ///< Too far from the epipolar line, or behind the cameras.
};

/// Finds points of the left image in the right one to a fraction of a pixel. Not thread-safe.
///
/// Points without an expected depth are searched at half resolution along their epipolar curve (the
/// images are not rectified) by zero-mean normalised correlation, and refused if a second place is
/// about as similar. All are then refined by AlignmentPatch, warped as a surface at that depth
/// looks from the right: without it near points would be off by tenths of a pixel. The refinement
/// is not bound to the curve, so that the distance from it is a test of the match.
class StereoMatcher {
 public:
  StereoMatcher(const StereoRig& rig, const TrackerConfig& config);

  /// One entry for each query. `left` needs derivatives.
  [[nodiscard]] std::vector<std::optional<StereoMatch>> match(const ImagePyramid& left,
                                                              const ImagePyramid& right,
                                                              std::span<const StereoQuery> queries);

  /// Bearing in the right camera of a left bearing at `inverse_depth` [1/m].
  [[nodiscard]] Eigen::Vector2d right_bearing(const Eigen::Vector2d& left,
                                              double inverse_depth) const;

  /// Of the last match().
  [[nodiscard]] const StereoStatistics& statistics() const { return statistics_; }

 private:
  // Along which the right camera sees it, of any length.
  [[nodiscard]] Eigen::Vector3d right_ray(const Eigen::Vector2d& left, double inverse_depth) const;

  struct Start {
    Eigen::Vector2f right_px;
    double inverse_depth;
  };
  [[nodiscard]] std::optional<Start> start_of(const ImagePyramid& left, const ImagePyramid& right,
                                              const StereoQuery& query) const;
  [[nodiscard]] std::optional<Start> search(const ImagePyramid& left, const ImagePyramid& right,
                                            const StereoQuery& query) const;
  [[nodiscard]] std::optional<StereoMatch> match_one(const ImagePyramid& left,
                                                     const ImagePyramid& right,
                                                     const StereoQuery& query);
  [[nodiscard]] std::optional<StereoMatch> triangulate(const StereoQuery& query,
                                                       const Eigen::Vector2f& right_px) const;

  StereoRig rig_;
  TrackerConfig config_;
  SE3 T_right_left_;
  StereoStatistics statistics_;
};

/// What StereoMatcher finds in a right image, read from a depth image instead: where the virtual
/// right camera of an RGB-D rig would see the points. Not thread-safe.
///
/// The right bearing is a function of the left one and the depth, so that an error of the left one
/// is in both, where stereo has two errors of their own. The smoother takes them for independent,
/// as ORB-SLAM2 does: it trusts the row of a point like stereo does, with two observations of it.
class DepthMatcher {
 public:
  /// Precondition: rig.depth_source is kDepthImage.
  DepthMatcher(const StereoRig& rig, const TrackerConfig& config);

  /// One entry for each query; its expected depth is not used. Without an image none is found.
  /// Nearer than TrackerConfig::min_depth_m counts as no depth. Precondition: `depth` fits the rig.
  [[nodiscard]] std::vector<std::optional<StereoMatch>> match(const DepthImage* depth,
                                                              std::span<const StereoQuery> queries);

  /// Of the last match(): `no_start` counts points without a depth, or on an edge between two.
  [[nodiscard]] const StereoStatistics& statistics() const { return statistics_; }

 private:
  SE3 T_right_left_;
  double max_inverse_depth_;
  double edge_;
  StereoStatistics statistics_;
};

}  // namespace km
