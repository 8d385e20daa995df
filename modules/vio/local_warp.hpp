#pragma once

#include <Eigen/Core>

#include "modules/core/camera.hpp"

namespace km {

/// How an image looks from elsewhere: maps small pixel offsets around the image of a landmark in
/// camera a to offsets around its image in camera b, for a surface that faces camera a. With the
/// lens distortion of both. `bearing_a` on z = 1, `inverse_depth` in a [1/m], T_b_a between the
/// cameras. Identity if the landmark is behind b.
[[nodiscard]] Eigen::Matrix2f local_warp(const PinholeCamera& a, const PinholeCamera& b,
                                         const Eigen::Vector2d& bearing_a, double inverse_depth,
                                         const SE3& T_b_a);

}  // namespace km
