#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "modules/core/camera/camera.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

/// Geometry of a point in both images.
struct StereoPoint {
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< Bearing on z = 1 of the left camera.
  double error_px = 0.0;  ///< Distance from the epipolar line in the right image.
  /// Distance from the projection of the point at infinity, in the right image.
  double parallax_px = 0.0;
  double depth_m = 0.0;  ///< z in the left camera; negative: behind it.
};

/// nullopt if a lens has no bearing for a pixel, or if the ray of the left pixel points away from
/// the right camera or along the baseline.
[[nodiscard]] std::optional<StereoPoint> stereo_point(const StereoRig& rig, const SE3& T_right_left,
                                                      const PixelPair& pair);

/// Agreement of matched points in both images of a pair with a calibration. The points are matched
/// over the whole image and not only near their epipolar lines.
struct StereoFit {
  std::size_t points = 0;
  /// Share of points near their epipolar line (kEpipolarInlier_px) and not behind the cameras.
  double inlier_ratio = 0.0;
  double error_px =
      0.0;               ///< Median distance from the line, in the right image; NaN without points.
  double depth_m = 0.0;  ///< Median depth of these points; NaN if there are none.
};

inline constexpr double kEpipolarInlier_px = 2.0;

/// Least number of points for a statement.
inline constexpr std::size_t kLeastStereoPoints = 100;

[[nodiscard]] StereoFit fit_of(std::span<const StereoMatches> images, const StereoRig& rig,
                               double inlier_px = kEpipolarInlier_px);

/// True if there are enough points and at least half of them are on their lines. In sound pairs
/// the ratio is 0.65 to 0.97.
[[nodiscard]] inline bool is_sound(const StereoFit& fit) {
  return fit.points >= kLeastStereoPoints && fit.inlier_ratio >= 0.5;
}

/// Possible faults of the calibration of a pair, or of the assignment of its images.
enum class StereoFault {
  kNone,
  kSwappedImages,    ///< The left image is the right camera's.
  kInvertedPair,     ///< T_left_right is its inverse.
  kInvertedCameras,  ///< Both T_body_cam are inverted.
  kInvertedLeft,     ///< Only the left T_body_cam is inverted.
  kInvertedRight,    ///< Only the right T_body_cam is inverted.
  kExchangedLenses,  ///< Focal lengths, centres and lenses are exchanged.
  kFocalLength,      ///< The right focal length is wrong, relative to the left focal length.
  kOtherMode,        ///< Both cameras are those of images of half or twice the size.
};

/// The calibration that fits the images.
struct StereoAlternative {
  StereoFault fault = StereoFault::kNone;
  /// kFocalLength: ratio of the right focal length to the given one. kOtherMode: that of both.
  double focal_ratio = 1.0;
  StereoFit fit;
};

/// `rig` after removal of the fault; unchanged for kNone, kSwappedImages, kFocalLength and
/// kOtherMode. The operation is its own inverse.
[[nodiscard]] StereoRig undone(const StereoRig& rig, StereoFault fault);

/// The fault whose removal fits the images best, if the fit is clearly better than that of `rig`.
/// Otherwise kNone, with the fit of `rig`.
[[nodiscard]] StereoAlternative best_alternative(std::span<const StereoMatches> images,
                                                 const StereoRig& rig);

}  // namespace km
