#pragma once

#include "modules/core/config.hpp"

namespace km {

// What a measured relative pose may say. Beyond, sums of poses overflow or lose their digits, and a
// solver ends in numbers that are none, for all robots. Public pose graphs have steps up to 50 m,
// translations up to 1e7 m (UTM), and information from 1e-5 to 3e12.

/// [m] of a relative pose, each coordinate: a thousand kilometres, of which a double keeps a
/// nanometre.
inline constexpr Bounds<double> kStep_m{-1e6, 1e6};

/// [m] of an estimated pose in a frame that may be that of a country.
inline constexpr Bounds<double> kPosition_m{-1e8, 1e8};

/// Trace of a covariance's rotation [rad^2] and translation [m^2], of what robots optimise.
inline constexpr Bounds<double> kVariance{1e-12, 1e12};

/// Variance on one axis in a g2o file [rad^2], [m^2]; also of graphs that no robot drives.
inline constexpr Bounds<double> kAxisVariance{1e-15, 1e12};

/// [rad] of the tilt that a vertical tells.
inline constexpr Bounds<double> kTiltSigma_rad{1e-4, 1.6};

}  // namespace km
