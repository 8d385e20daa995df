#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/camera.hpp"
#include "modules/diagnosis/sensor_sample.hpp"

namespace km {

/// What a point in both images says.
struct StereoPoint {
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  ///< Bearing on z = 1 of the left camera.
  double error_px = 0.0;     ///< Distance from the epipolar line in the right image.
  double parallax_px = 0.0;  ///< From where it would be at infinity, likewise.
  double depth_m = 0.0;      ///< z in the left camera; negative: behind it.
};

/// nullopt if a lens has no bearing for a pixel, or for a point that only an opposite camera sees.
[[nodiscard]] std::optional<StereoPoint> stereo_point(const StereoRig& rig, const SE3& T_right_left,
                                                      const PixelPair& pair);

/// How points found in both images of a pair, wherever they lie, go with a calibration.
struct StereoFit {
  std::size_t points = 0;
  double on_line = 0.0;  ///< Share within kOnLine_px of their epipolar line and not behind().
  double behind = 0.0;   ///< Share within it whose rays meet behind the cameras.
  double error_px =
      0.0;               ///< Median distance from the line, in the right image; NaN without points.
  double depth_m = 0.0;  ///< Median of those on_line; NaN without.
};

inline constexpr double kOnLine_px = 2.0;

/// Fewer points say nothing.
inline constexpr std::size_t kLeastStereoPoints = 100;

[[nodiscard]] StereoFit fit_of(std::span<const StereoMatches> images, const StereoRig& rig);

/// Enough points, half of them on their lines: sound pairs have 0.65 to 0.97.
[[nodiscard]] inline bool is_sound(const StereoFit& fit) {
  return fit.points >= kLeastStereoPoints && fit.on_line >= 0.5;
}

/// What may be wrong with the calibration of a pair, or with the images that it is taken to be of.
enum class StereoFault {
  kNone,
  kSwappedImages,    ///< The left image is the right camera's.
  kInvertedPair,     ///< T_left_right is its inverse.
  kInvertedCameras,  ///< Both T_body_cam are their inverses.
  kInvertedLeft,     ///< Only the left T_body_cam is.
  kInvertedRight,    ///< Only the right one is.
  kExchangedLenses,  ///< Focal lengths, centres and lenses are the other camera's.
  kFocalLength,      ///< Of the right camera, against the left one's.
};

/// The calibration that the images would fit.
struct StereoAlternative {
  StereoFault fault = StereoFault::kNone;
  double focal_ratio = 1.0;  ///< kFocalLength: the right focal length over the given one.
  StereoFit fit;
};

/// `rig` as it is if `fault` was made; its own inverse.
[[nodiscard]] StereoRig undone(const StereoRig& rig, StereoFault fault);

/// The fault that explains the images best, where it does so clearly better than `rig` as it is;
/// kNone, with the fit of `rig`, else.
[[nodiscard]] StereoAlternative best_alternative(std::span<const StereoMatches> images,
                                                 const StereoRig& rig);

}  // namespace km
