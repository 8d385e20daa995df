#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "modules/core/data/byte_archive.hpp"
#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// A rigid transform in single precision, as in messages.
struct SinglePose {
  Eigen::Quaternionf q = Eigen::Quaternionf::Identity();
  Eigen::Vector3f t = Eigen::Vector3f::Zero();  ///< [m]

  [[nodiscard]] static SinglePose of(const SE3& T) {
    return {Eigen::Quaterniond(T.linear()).cast<float>(), T.translation().cast<float>()};
  }
  /// The transform in double precision, equal on all robots to the last bit.
  [[nodiscard]] SE3 pose() const {
    return make_pose(q.cast<double>().normalized().toRotationMatrix(), t.cast<double>());
  }
};

/// True if the quaternion has unit length, and the position is not too far away.
[[nodiscard]] inline bool is_valid(const SinglePose& pose) {
  return std::abs(pose.q.cast<double>().norm() - 1.0) <= kUnitTolerance && pose.t.allFinite() &&
         static_cast<double>(pose.t.cwiseAbs().maxCoeff()) <= kMaxTranslation_m;
}

void describe(auto& archive, As<SinglePose> auto& pose) {
  archive(pose.q.coeffs(), pose.t);
  archive.require(is_valid(pose));
}

}  // namespace km
