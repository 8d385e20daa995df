#pragma once

#include <common.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/keyframe.hpp"
#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/geometry/covariance_root.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"

namespace km {

// Conversions between the parts of idl/common.idl and core types, for all codecs. from_wire()
// treats its input as untrusted: nullopt if a number is not finite or does not have the meaning of
// its field.

/// Largest magnitude of an element of an accepted covariance [rad^2, m^2].
inline constexpr double kMaxWireVariance = 1e14;

inline km_wire_KeyframeRef to_wire(const KeyframeId& id) {
  return {.robot = id.robot, .index = id.index};
}

inline KeyframeId from_wire(const km_wire_KeyframeRef& wire) {
  return {wire.robot, wire.index};
}

inline km_wire_Pose to_wire(const SE3& T_a_b) {
  const Eigen::Quaterniond q(T_a_b.linear());
  const Eigen::Vector3d& t = T_a_b.translation();
  return {.q = {q.x(), q.y(), q.z(), q.w()}, .t = {t.x(), t.y(), t.z()}};
}

inline std::optional<SE3> from_wire(const km_wire_Pose& wire) {
  const Eigen::Quaterniond q(Eigen::Vector4d(wire.q[0], wire.q[1], wire.q[2], wire.q[3]));
  const Eigen::Vector3d t(wire.t[0], wire.t[1], wire.t[2]);
  // Written so that NaN fails.
  if (!(std::abs(q.norm() - 1.0) <= kUnitTolerance)) return std::nullopt;
  if (!(t.cwiseAbs().maxCoeff() <= kMaxTranslation_m) || !t.allFinite()) return std::nullopt;
  return make_pose(q.normalized().toRotationMatrix(), t);
}

inline km_wire_Covariance to_wire(const Matrix6& Sigma) {
  km_wire_Covariance wire{};
  int k = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) wire.upper[k++] = Sigma(r, c);
  return wire;
}

/// Accepts semi-definite matrices, also zero: the covariance of the first keyframe of a chain.
inline std::optional<Matrix6> from_wire(const km_wire_Covariance& wire) {
  Matrix6 Sigma;
  int k = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) Sigma(r, c) = Sigma(c, r) = wire.upper[k++];
  if (!Sigma.allFinite() || Sigma.cwiseAbs().maxCoeff() > kMaxWireVariance) return std::nullopt;
  if (!is_covariance(Sigma)) return std::nullopt;
  return Sigma;
}

inline km_wire_OdometryPose to_wire(const OdometryPose& pose) {
  const Eigen::Quaternionf q = Eigen::Quaterniond(pose.T_odom_kf.linear()).cast<float>();
  const Eigen::Vector3d& t = pose.T_odom_kf.translation();
  km_wire_OdometryPose wire{.keyframe = to_wire(pose.id),
                            .q = {q.x(), q.y(), q.z(), q.w()},
                            .t = {t.x(), t.y(), t.z()},
                            .root = {}};
  std::ranges::copy(covariance_root(pose.covariance), wire.root);
  return wire;
}

inline std::optional<OdometryPose> from_wire(const km_wire_OdometryPose& wire) {
  const Eigen::Vector4d q = Eigen::Vector4f(wire.q).cast<double>();
  const std::optional<SE3> T_odom_kf = from_wire(
      km_wire_Pose{.q = {q[0], q[1], q[2], q[3]}, .t = {wire.t[0], wire.t[1], wire.t[2]}});
  const std::optional<Matrix6> covariance = covariance_of(wire.root);
  if (!T_odom_kf || !covariance || covariance->maxCoeff() > kMaxWireVariance) return std::nullopt;
  return OdometryPose{from_wire(wire.keyframe), *T_odom_kf, *covariance};
}

}  // namespace km
