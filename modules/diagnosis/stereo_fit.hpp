#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera.hpp"
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

/// nullopt if a lens has no bearing for a pixel, or if only an opposite camera could see the point.
[[nodiscard]] std::optional<StereoPoint> stereo_point(const StereoRig& rig, const SE3& T_right_left,
                                                      const PixelPair& pair);

/// Agreement of points in both images of a pair, at any position, with a calibration.
struct StereoFit {
  std::size_t points = 0;
  /// Share within kOnLine_px of their epipolar line and not behind the cameras.
  double on_line = 0.0;
  double behind = 0.0;  ///< Share within kOnLine_px whose rays meet behind the cameras.
  double error_px =
      0.0;               ///< Median distance from the line, in the right image; NaN without points.
  double depth_m = 0.0;  ///< Median depth of the points on_line; NaN if there are none.
};

inline constexpr double kOnLine_px = 2.0;

/// Fewer points permit no statement.
inline constexpr std::size_t kLeastStereoPoints = 100;

[[nodiscard]] StereoFit fit_of(std::span<const StereoMatches> images, const StereoRig& rig);

/// Enough points, and at least half of them on their lines: sound pairs have 0.65 to 0.97.
[[nodiscard]] inline bool is_sound(const StereoFit& fit) {
  return fit.points >= kLeastStereoPoints && fit.on_line >= 0.5;
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
  kFocalLength,      ///< Focal length of the right camera, relative to the left one's.
};

/// The calibration that fits the images.
struct StereoAlternative {
  StereoFault fault = StereoFault::kNone;
  double focal_ratio = 1.0;  ///< kFocalLength: ratio of the right focal length to the given one.
  StereoFit fit;
};

/// `rig` after removal of the fault; the operation is its own inverse.
[[nodiscard]] StereoRig undone(const StereoRig& rig, StereoFault fault);

/// The fault that explains the images best if it is clearly better than `rig`. Otherwise kNone,
/// with the fit of `rig`.
[[nodiscard]] StereoAlternative best_alternative(std::span<const StereoMatches> images,
                                                 const StereoRig& rig);

}  // namespace km
