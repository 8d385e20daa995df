#include "modules/constellations/constellation_pose.hpp"

#include <cmath>

namespace km {
namespace {

// Weighted means of both sides: horizontal coordinates by their variances, z by its own.
struct Centroids {
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
};

Centroids centroids_of(std::span<const LandmarkPair> pairs) {
  Centroids mean;
  double side_weight = 0.0, height_weight = 0.0;
  for (const LandmarkPair& pair : pairs) {
    const double side = 1.0 / pair.side_variance(), height = 1.0 / pair.height_variance();
    const Eigen::Vector3d weight(side, side, height);
    mean.a += weight.cwiseProduct(pair.a.center);
    mean.b += weight.cwiseProduct(pair.b.center);
    side_weight += side;
    height_weight += height;
  }
  const Eigen::Vector3d total(side_weight, side_weight, height_weight);
  return {mean.a.cwiseQuotient(total), mean.b.cwiseQuotient(total)};
}

double yaw_of(std::span<const LandmarkPair> pairs, const Centroids& mean) {
  double sine = 0.0, cosine = 0.0;
  for (const LandmarkPair& pair : pairs) {
    const Eigen::Vector2d a = (pair.a.center - mean.a).head<2>();
    const Eigen::Vector2d b = (pair.b.center - mean.b).head<2>();
    sine += (b.x() * a.y() - b.y() * a.x()) / pair.side_variance();
    cosine += a.dot(b) / pair.side_variance();
  }
  return std::atan2(sine, cosine);
}

// Covariance of [yaw; translation in the plane] in the axes of b at its centroid: Eq. (1).
Eigen::Matrix3d plane_covariance(std::span<const LandmarkPair> pairs, const Centroids& mean) {
  using Jacobian = Eigen::Matrix<double, 2, 3>;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> g_a = Eigen::Matrix<double, 3, 2>::Zero(), g_b = g_a;
  for (const LandmarkPair& pair : pairs) {
    const Eigen::Vector3d p = pair.b.center - mean.b;
    Jacobian J;
    J << -p.y(), 1.0, 0.0, p.x(), 0.0, 1.0;
    const double w = 1.0 / pair.side_variance();
    A += w * J.transpose() * J;
    g_a += w * pair.a.side_shift_m * J.transpose();
    g_b += w * pair.b.side_shift_m * J.transpose();
  }
  const Eigen::Matrix3d inverse = A.inverse();
  const Eigen::Matrix<double, 3, 2> G_a = inverse * g_a, G_b = inverse * g_b;
  return inverse + G_a * G_a.transpose() + G_b * G_b.transpose();
}

// Variance of z, as Eq. (1) in one dimension.
double height_variance(std::span<const LandmarkPair> pairs) {
  double total = 0.0, shift_a = 0.0, shift_b = 0.0;
  for (const LandmarkPair& pair : pairs) {
    const double w = 1.0 / pair.height_variance();
    total += w;
    shift_a += w * pair.a.height_shift_m;
    shift_b += w * pair.b.height_shift_m;
  }
  return 1.0 / total + (shift_a * shift_a + shift_b * shift_b) / (total * total);
}

}  // namespace

UncertainPose constellation_pose(std::span<const LandmarkPair> pairs, double tilt_rad) {
  const Centroids mean = centroids_of(pairs);
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(yaw_of(pairs, mean), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  // Frame c: the axes of b, with the origin at the centroid of b.
  UncertainPose T_a_c{make_pose(R, mean.a), Matrix6::Zero()};
  T_a_c.Sigma(0, 0) = T_a_c.Sigma(1, 1) = 2.0 * tilt_rad * tilt_rad;
  T_a_c.Sigma.block<3, 3>(2, 2) = plane_covariance(pairs, mean);
  T_a_c.Sigma(5, 5) = height_variance(pairs);
  const SE3 T_c_b = make_pose(Eigen::Matrix3d::Identity(), -mean.b);
  return compose(T_a_c, {T_c_b, Matrix6::Zero()});
}

}  // namespace km
