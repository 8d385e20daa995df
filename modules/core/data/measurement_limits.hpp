#pragma once

#include "modules/core/config.hpp"

namespace km {

// Limits of a measured relative pose. Beyond them, sums of poses overflow or lose their digits, and
// a solver ends in non-finite numbers for all robots. Public pose graphs have steps up to 50 m,
// translations up to 1e7 m (UTM), and information from 1e-5 to 3e12.

/// Each coordinate of a relative pose [m]: a thousand kilometres, at which a double still resolves
/// a nanometre.
inline constexpr Bounds<double> kStep_m{-1e6, 1e6};

/// Largest coordinate of a pose in a message [m]: no robot is farther from the origin of a frame.
inline constexpr double kMaxTranslation_m = 1e7;

/// Largest deviation of a quaternion or a direction from unit length, in messages and files: some
/// round to 6 digits. Every user normalises it.
inline constexpr double kUnitTolerance = 1e-3;

/// Each coordinate of an estimated pose [m], in a frame that may be that of a country.
inline constexpr Bounds<double> kPosition_m{-1e8, 1e8};

/// Trace of the rotation [rad^2] and translation [m^2] blocks of a covariance that robots optimise.
inline constexpr Bounds<double> kVariance{1e-12, 1e12};

/// Variance on one axis in a graph file [rad^2], [m^2], also of graphs that no robot solves.
inline constexpr Bounds<double> kAxisVariance{1e-15, 1e12};

/// Standard deviation on each axis of the step between two runs of a robot [m]: it was carried, so
/// that the length of the step is unknown. No step inside a run has a tenth of it.
inline constexpr double kUnknownStep_m = 1e4;
/// Each coordinate of a fix [m]. The step from the datum to the first keyframe is unknown, and four
/// of its standard deviations are the most that it agrees with. Fixes 900 km away make a team
/// reject true closures between other robots.
inline constexpr Bounds<double> kFix_m{-4.0 * kUnknownStep_m, 4.0 * kUnknownStep_m};
/// Standard deviation of the rotation of such a step. A turn by pi then costs 0.01 in the cost of
/// the pose graph. That of a uniform rotation would pull the two runs towards one attitude.
inline constexpr double kUnknownTurn_rad = 20.0;

/// Standard deviation of the tilt of a vertical [rad].
inline constexpr Bounds<double> kTiltSigma_rad{1e-4, 1.6};

}  // namespace km
