#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/core/camera/frame.hpp"
#include "modules/vio/image_pyramid.hpp"
#include "modules/vio/tracker_config.hpp"

namespace km {

/// A point of the left image to be found in the right one.
struct StereoQuery {
  Eigen::Vector2f left_px = Eigen::Vector2f::Zero();
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< Undistorted bearing of left_px.
  std::optional<double> inverse_depth;             ///< Expected 1/z in the left camera [1/m].
};

/// Position of a query in the right image.
struct StereoMatch {
  Eigen::Vector2d right = Eigen::Vector2d::Zero();  ///< Bearing in the right camera.
  double inverse_depth = 0.0;  ///< 1/z in the left camera [1/m]; not negative, 0 is infinity.
};

/// Finds points of the left image in the right one to a fraction of a pixel.
///
/// A point without an expected depth is searched at half resolution along its epipolar curve (the
/// images are not rectified) by zero-mean normalised correlation. The point is refused if a second
/// place is about as similar. AlignmentPatch then refines all points, with the warp of a surface at
/// that depth seen from the right. Without this warp, near points would be off by tenths of a
/// pixel. The refinement may leave the curve, so the distance from the curve tests the match.
class StereoMatcher {
 public:
  StereoMatcher(const StereoRig& rig, const TrackerConfig& config);

  /// The match of each query; nullopt if there is none. Precondition: `left` has derivatives.
  [[nodiscard]] std::vector<std::optional<StereoMatch>> match(
      const ImagePyramid& left, const ImagePyramid& right,
      std::span<const StereoQuery> queries) const;

  /// Bearing in the right camera of a left bearing at `inverse_depth` [1/m].
  [[nodiscard]] Eigen::Vector2d right_bearing(const Eigen::Vector2d& left,
                                              double inverse_depth) const;

 private:
  // Ray of any length from the right camera to the point.
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
                                                     const StereoQuery& query) const;
  [[nodiscard]] std::optional<StereoMatch> triangulate(const StereoQuery& query,
                                                       const Eigen::Vector2f& right_px) const;

  StereoRig rig_;
  TrackerConfig config_;
  SE3 T_right_left_;
};

/// Replaces StereoMatcher for RGB-D rigs: computes from a depth image where the virtual right
/// camera would see the points.
///
/// The right bearing is a function of the left bearing and the depth, so both contain the same
/// error. The smoother assumes independent errors, as for stereo and as ORB-SLAM2 does. The row of
/// a point therefore has the weight of two observations.
class DepthMatcher {
 public:
  /// Precondition: rig.depth_source is kDepthImage.
  DepthMatcher(const StereoRig& rig, const TrackerConfig& config);

  /// The match of each query, whose expected depth is not used; nullopt if there is none. All are
  /// nullopt if `depth` is null. A depth below TrackerConfig::min_depth_m counts as none.
  /// Precondition: `depth` fits the rig.
  [[nodiscard]] std::vector<std::optional<StereoMatch>> match(
      const DepthImage* depth, std::span<const StereoQuery> queries) const;

 private:
  SE3 T_right_left_;
  double max_inverse_depth_;
  double edge_;
};

}  // namespace km
