#include "modules/core/geometry/lie.hpp"

#include <Eigen/SVD>
#include <cmath>

namespace km {
namespace {

constexpr double kSmallAngle = 1e-5;  // below it the next term of each series is under 1e-20

// Left Jacobian of SO(3): the translation part of the exponential of SE(3).
Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& phi) {
  return so3_right_jacobian(-phi);
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d S;
  S << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return S;
}

Eigen::Matrix3d so3_exp(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  Eigen::Quaterniond q;
  q.w() = std::cos(0.5 * angle);
  q.vec() =
      (angle < kSmallAngle ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle) * phi;
  return q.normalized().toRotationMatrix();
}

Eigen::Vector3d so3_log(const Eigen::Matrix3d& R) {
  Eigen::Quaterniond q(R);  // well conditioned up to pi, unlike the trace formula
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < kSmallAngle) return (2.0 / q.w()) * q.vec();
  return (2.0 * std::atan2(sine, q.w()) / sine) * q.vec();
}

Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& phi) {
  const double angle2 = phi.squaredNorm();
  const double angle = std::sqrt(angle2);
  const Eigen::Matrix3d S = skew(phi);
  if (angle < kSmallAngle) return Eigen::Matrix3d::Identity() - 0.5 * S + S * S / 6.0;
  return Eigen::Matrix3d::Identity() - (1.0 - std::cos(angle)) / angle2 * S +
         (angle - std::sin(angle)) / (angle2 * angle) * S * S;
}

Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& phi) {
  const double angle2 = phi.squaredNorm();
  const double angle = std::sqrt(angle2);
  const Eigen::Matrix3d S = skew(phi);
  if (angle < kSmallAngle) return Eigen::Matrix3d::Identity() + 0.5 * S + S * S / 12.0;
  // 1/angle^2 - (1 + cos) / (2 angle sin), written with the half angle to stay finite at pi.
  const double half = 0.5 * angle;
  const double c = (1.0 - half * std::cos(half) / std::sin(half)) / angle2;
  return Eigen::Matrix3d::Identity() + 0.5 * S + c * S * S;
}

SE3 se3_exp(const Vector6& xi) {
  const Eigen::Vector3d phi = xi.head<3>();
  return make_pose(so3_exp(phi), so3_left_jacobian(phi) * xi.tail<3>());
}

Vector6 se3_log(const SE3& T) {
  const Eigen::Vector3d phi = so3_log(T.linear());
  Vector6 xi;
  xi.head<3>() = phi;
  xi.tail<3>() = so3_right_jacobian_inverse(-phi) * T.translation();
  return xi;
}

Matrix6 adjoint(const SE3& T) {
  Matrix6 A = Matrix6::Zero();
  A.topLeftCorner<3, 3>() = T.linear();
  A.bottomRightCorner<3, 3>() = T.linear();
  A.bottomLeftCorner<3, 3>() = skew(T.translation()) * T.linear();
  return A;
}

SE3 retract(const SE3& T, const Eigen::Ref<const Vector6>& delta) {
  const Eigen::Quaterniond q(T.linear() * so3_exp(delta.head<3>()));
  return make_pose(q.normalized().toRotationMatrix(),
                   T.translation() + T.linear() * delta.tail<3>());
}

Vector6 local_coordinates(const SE3& from, const SE3& to) {
  Vector6 delta;
  delta.head<3>() = so3_log(from.linear().transpose() * to.linear());
  delta.tail<3>() = from.linear().transpose() * (to.translation() - from.translation());
  return delta;
}

Eigen::Matrix3d rotation_to_z(const Eigen::Vector3d& up) {
  const Eigen::Vector3d u = up.normalized();
  const double across2 = u.head<2>().squaredNorm();
  if (across2 == 0.0 && u.z() < 0.0) return Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  // The quaternion (1 + u^T z, u x z), with 1 + u_z written without cancellation.
  const double w = u.z() > 0.0 ? 1.0 + u.z() : across2 / (1.0 - u.z());
  return Eigen::Quaterniond(w, u.y(), -u.x(), 0.0).normalized().toRotationMatrix();
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

Eigen::MatrixXd nearest_stiefel(const Eigen::MatrixXd& M) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(M, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace km
