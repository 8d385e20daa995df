#pragma once

#include "modules/core/geometry.hpp"

namespace km {

/// The second derivatives of a team do not change if all poses move together. Covariances of poses
/// are therefore relative to a pose of the team, the origin: keyframe 0 of the robot whose odometry
/// frame is `world`.
///
/// The equations are solved with another pose held, and are then related to the origin. Let xi_b be
/// the error of the origin as a tangent vector of SE(3), see edge_model.hpp, and gamma = M xi_b the
/// motion of the world [rotation; translation] that carries the origin to its estimate. Moving the
/// team back by gamma changes the error of pose i to xi_i - A_i gamma, where A_i = [R^T, 0; -R^T
/// [t]x, R^T]. If P_ii is the covariance of xi_i, X_i that of xi_i with gamma, and C that of gamma,
/// the covariance relative to the origin is
///     P_ii - X_i A_i^T - A_i X_i^T + A_i C A_i^T.
/// X = P E_b M^T follows from one solution with six right-hand sides.

/// M for the origin at `T_world_origin`. `upright`: verticals fix the tilt of `world`, so that
/// gamma only turns about z and moves the origin.
[[nodiscard]] Matrix6 frame_motion(const SE3& T_world_origin, bool upright);

/// Covariance of the pose `T_world_kf` relative to the origin. Negative eigenvalues from rounding
/// become zero.
[[nodiscard]] Matrix6 relative_to_origin(const Matrix6& P, const Matrix6& X, const Matrix6& C,
                                         const SE3& T_world_kf);

}  // namespace km
