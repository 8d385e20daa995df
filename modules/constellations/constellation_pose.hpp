#pragma once

#include <span>

#include "modules/constellations/landmark.hpp"
#include "modules/core/data/covariance.hpp"

namespace km {

/// T_a_b that lays the landmarks of b on those of a, between two frames with z up: yaw and
/// translation. It minimises the sum of the squared distances of the pairs, weighted by their
/// variances, in the plane and along z separately. In the plane, the minimum has a closed form: the
/// planar case of Umeyama, "Least-Squares Estimation of Transformation Parameters Between Two Point
/// Patterns", PAMI 1991, without scale.
///
/// The covariance (see modules/core/data/covariance.hpp) has three parts, with the Jacobians J of
/// the distances by yaw and translation, the weights w, and A = sum w J^T J:
///
///     Sigma = A^-1 + G_a G_a^T + G_b G_b^T,   G = A^-1 sum w s J^T                             (1)
///
/// A^-1 is that of independent errors. In G, the shift of all boxes of a robot has one direction,
/// and s is its standard deviation (Landmark::side_shift_m). Shifts are in both parts, because
/// their true correlation is unknown and between these extremes. Roll and pitch have the variance
/// of the tilt of both frames, 2 tilt_rad^2.
///
/// Precondition: two pairs at different positions in the plane. Linear in the pairs.
[[nodiscard]] UncertainPose constellation_pose(std::span<const LandmarkPair> pairs,
                                               double tilt_rad);

}  // namespace km
