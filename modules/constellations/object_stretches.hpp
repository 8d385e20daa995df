#pragma once

#include <vector>

#include "modules/constellations/landmark.hpp"
#include "modules/objects/map_object.hpp"

namespace km {

/// Objects that a robot mapped near one keyframe. Over such a stretch of its trajectory, the drift
/// of odometry is small.
struct ObjectStretch {
  SurfaceKeyframe keyframe;
  /// Those of the message in the same visit, the keyframe of the stretch among them.
  std::vector<SurfaceKeyframe> keyframes;
  /// In the frame with the axes of `world` and the origin at the keyframe. z is up.
  std::vector<Landmark> landmarks;
};

/// Drift of odometry within a stretch, as a share of the distance.
inline constexpr double kStretchDrift = 0.01;

/// Objects within this distance of a keyframe are matched together. Small enough that odometry
/// drifts little within it; in maps of two cities and a camp, 40 m give half as many matches.
inline constexpr double kStretchRadius_m = 60.0;

/// The largest number of landmarks of a stretch; those nearest to its keyframe count. Bounds the
/// time of a match.
inline constexpr std::size_t kMaxLandmarks = 80;

/// The stretches of the keyframes that the message states, with `min_landmarks` or more, in the
/// order of these keyframes. Two of them are at least half of kStretchRadius_m apart. An object
/// belongs to a stretch if it is within kStretchRadius_m, and if its keyframe is within 100
/// keyframes: a later visit has drifted. Objects with a standard deviation above 1 m are left out,
/// so sizes of misbehaving peers have no effect.
[[nodiscard]] std::vector<ObjectStretch> stretches_of(const RobotObjects& objects,
                                                      std::size_t min_landmarks);

/// True if a match of `a` may differ from one of `b`: other keyframe or landmarks, or a centre that
/// has moved by more than 5 cm.
[[nodiscard]] bool differ(const ObjectStretch& a, const ObjectStretch& b);

}  // namespace km
