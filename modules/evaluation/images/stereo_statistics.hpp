#pragma once

#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/core/stamp.hpp"
#include "modules/evaluation/images/forward_backward.hpp"
#include "modules/evaluation/images/image_figure.hpp"

namespace km {

/// Shares of points that are found in the other camera, and some time later.
///
/// ORB: OpenCV's, 1000 features, brute force over the whole image, ratio test 0.8. An inlier from
/// left to right is within 1.5 px of its epipolar line. An inlier from left to left, 0.25, 0.5 and
/// 1 s apart, is within 1.5 px of the line from the essential matrix of RANSAC. KLT from left to
/// right starts at the position of the point at infinite depth, and back from there at the point
/// itself. Depth by triangulation: z [m] in the left camera.
class StereoStatistics {
 public:
  explicit StereoStatistics(const StereoRig& rig);

  /// Adds a pair and the corners of its left image. `right` may be empty: a rig with one camera.
  void add(Stamp stamp, const KltImage& left, const KltImage& right,
           const std::vector<cv::Point2f>& corners);

  void append_to(std::vector<ImageFigure>& figures) const;

 private:
  struct OrbImage {
    Stamp stamp = 0;
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
  };
  struct LagFigures {
    double lag_s = 0.0;
    std::vector<double> matches, inlier_shares;
  };
  // Geometry of a match between a point in the left image and one in the right image.
  struct StereoMatch {
    double epipolar_error_px = 0.0;
    double depth_m = 0.0;  // negative: behind the cameras
  };

  [[nodiscard]] std::optional<StereoMatch> judge(const cv::Point2f& left,
                                                 const cv::Point2f& right) const;
  // Position in the right image of a left point at infinite depth.
  [[nodiscard]] cv::Point2f at_infinity(const cv::Point2f& left) const;
  void add_orb(const OrbImage& left, const cv::Mat& right);
  void add_later_views(const OrbImage& left);
  void add_klt(const KltImage& left, const KltImage& right,
               const std::vector<cv::Point2f>& corners);

  StereoRig rig_;
  SE3 T_right_left_;
  std::deque<OrbImage> earlier_;  // left images of the last second
  std::vector<double> right_corners_, fast_;
  std::vector<double> orb_matches_, orb_shares_, orb_with_depth_, orb_errors_px_;
  std::vector<LagFigures> lags_ = {{0.25, {}, {}}, {0.5, {}, {}}, {1.0, {}, {}}};
  std::vector<double> klt_passed_, klt_on_line_, klt_matches_, klt_errors_px_, depths_m_;
};

}  // namespace km
