#include "modules/loop_closure/transfer_error.hpp"

#include <Eigen/LU>
#include <cmath>

#include "modules/core/lie.hpp"

namespace km {
namespace {

constexpr double kPyramidScale = 1.2;
constexpr double kLeastDepthRatio = 1e-3;  // h_z = depth in b over depth in a

// d(prediction)/d(h), prediction = (h_x, h_y, rho) / h_z.
Eigen::Matrix3d projection_jacobian(const Eigen::Vector3d& h, double rho) {
  const double s = 1.0 / h.z();
  Eigen::Matrix3d J;
  J << s, 0.0, -h.x() * s * s,  //
      0.0, s, -h.y() * s * s,   //
      0.0, 0.0, -rho * s * s;
  return J;
}

Eigen::Vector3d carried(const SE3& T_b_a, const Eigen::Vector3d& m) {
  return T_b_a.linear() * Eigen::Vector3d(m.x(), m.y(), 1.0) + m.z() * T_b_a.translation();
}

}  // namespace

ImagePoint image_point(const KeyframeFeatures& features, std::size_t index,
                       const ImageNoise& noise) {
  const Keypoint& keypoint = features.keypoints[index];
  const double bearing =
      noise.keypoint_px * std::pow(kPyramidScale, keypoint.octave) / features.focal_px;
  const double inverse_depth = noise.disparity_px / (features.focal_px * features.baseline_m);
  ImagePoint point;
  point.m << keypoint.bearing.cast<double>(), static_cast<double>(keypoint.inverse_depth);
  point.variance << bearing * bearing, bearing * bearing, inverse_depth * inverse_depth;
  point.has_depth = keypoint.has_depth();
  return point;
}

TransferError transfer_error(const SE3& T_b_a, const ImagePoint& a, const ImagePoint& b) {
  return transfer_error(T_b_a, a, b, a.m);
}

TransferError transfer_error(const SE3& T_b_a, const ImagePoint& a, const ImagePoint& b,
                             const Eigen::Vector3d& m) {
  TransferError error;
  const Eigen::Vector3d h = carried(T_b_a, m);
  error.in_front = h.z() > kLeastDepthRatio;
  if (!error.in_front) return error;
  const double s = 1.0 / h.z();
  error.dim = b.has_depth ? 3 : 2;

  Eigen::Matrix3d dh_dm;  // d(h)/d(x, y, rho)
  dh_dm << T_b_a.linear().leftCols<2>(), T_b_a.translation();
  Eigen::Matrix3d G = projection_jacobian(h, m.z()) * dh_dm;
  G(2, 2) += s;
  error.r = Eigen::Vector3d(h.x() * s, h.y() * s, m.z() * s) + G * (a.m - m) - b.m;
  Eigen::Matrix3d Sigma = G * a.variance.asDiagonal() * G.transpose();
  Sigma.diagonal() += b.variance;
  if (b.has_depth) {
    error.information = Sigma.inverse();
  } else {
    error.r.z() = 0.0;
    error.information.topLeftCorner<2, 2>() = Sigma.topLeftCorner<2, 2>().inverse();
  }
  const Eigen::Vector3d weighted = error.information * error.r;
  error.chi2 = error.r.dot(weighted);
  error.likely = a.m - a.variance.cwiseProduct(G.transpose() * weighted);
  return error;
}

Eigen::Matrix<double, 3, 6> transfer_jacobian(const SE3& T_b_a, const Eigen::Vector3d& m) {
  // (T_a_b exp(xi))^-1 = exp(-xi) T_b_a moves h by -(omega x h) - rho v.
  const Eigen::Vector3d h = carried(T_b_a, m);
  Eigen::Matrix<double, 3, 6> dh;
  dh << skew(h), -m.z() * Eigen::Matrix3d::Identity();
  return projection_jacobian(h, m.z()) * dh;
}

}  // namespace km
