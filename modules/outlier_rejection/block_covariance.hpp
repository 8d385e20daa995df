#pragma once

#include "modules/core/geometry.hpp"
#include "modules/core/lie.hpp"

namespace km {

/// A symmetric 6x6 matrix, tangent [rotation; translation], by the three blocks that say it all:
/// [rr rt; rt^T tt]. Moving it into another frame costs a third of the same with Matrix6.
struct BlockCovariance {
  Eigen::Matrix3d rr = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d rt = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d tt = Eigen::Matrix3d::Zero();

  BlockCovariance() = default;
  /// The lower left block of `Sigma` is taken for the transpose of the upper right one.
  explicit BlockCovariance(const Matrix6& Sigma)
      : rr(Sigma.topLeftCorner<3, 3>()),
        rt(Sigma.topRightCorner<3, 3>()),
        tt(Sigma.bottomRightCorner<3, 3>()) {}

  [[nodiscard]] Matrix6 matrix() const {
    Matrix6 Sigma;
    Sigma << rr, rt, rt.transpose(), tt;
    return Sigma;
  }

  BlockCovariance& operator+=(const BlockCovariance& other) {
    rr += other.rr;
    rt += other.rt;
    tt += other.tt;
    return *this;
  }
  friend BlockCovariance operator-(const BlockCovariance& x, const BlockCovariance& y) {
    BlockCovariance difference;
    difference.rr = x.rr - y.rr;
    difference.rt = x.rt - y.rt;
    difference.tt = x.tt - y.tt;
    return difference;
  }
};

/// adjoint(T) * Sigma * adjoint(T)^T.
[[nodiscard]] inline BlockCovariance transported(const SE3& T, const BlockCovariance& Sigma) {
  const Eigen::Matrix3d R = T.linear();
  const Eigen::Matrix3d K = skew(T.translation());
  const Eigen::Matrix3d B = R * Sigma.rt * R.transpose();
  BlockCovariance moved;
  moved.rr = R * Sigma.rr * R.transpose();
  moved.rt = B - moved.rr * K;  // K^T = -K
  const Eigen::Matrix3d KB = K * B;
  moved.tt = R * Sigma.tt * R.transpose() + KB + KB.transpose() - K * moved.rr * K;
  return moved;
}

}  // namespace km
