#pragma once

#include "modules/core/geometry.hpp"

namespace km {

/// Retraction of every estimator here: R' = R exp(rotation), t' = t + R translation, of
/// delta = [rotation; translation]. It equals T * exp(delta) to first order (Forster et al., TRO
/// 2017, Sec. III-C, Eq. (21)).
[[nodiscard]] SE3 retract(const SE3& T, const Eigen::Ref<const Vector6>& delta);

/// Inverse of retract(): the delta from `from` to `to`.
[[nodiscard]] Vector6 local_coordinates(const SE3& from, const SE3& to);

}  // namespace km
