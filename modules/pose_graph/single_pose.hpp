#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "modules/core/byte_archive.hpp"
#include "modules/core/geometry.hpp"

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

/// Largest deviation of a received quaternion from unit length; every user normalises it.
inline constexpr double kUnitTolerance = 1e-3;

void describe(auto& archive, As<SinglePose> auto& pose) {
  archive(pose.q.coeffs(), pose.t);
  archive.require(std::abs(pose.q.template cast<double>().norm() - 1.0) <= kUnitTolerance);
}

}  // namespace km
