#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Standard deviations of the measurements of a keyframe, at the finest level of the pyramid.
struct ImageNoise {
  double keypoint_px = 0.7;   ///< Position in the image; grows by 1.2 with each octave.
  double disparity_px = 0.3;  ///< Stereo disparity at the keyframe's focal length.
};

/// A keypoint as a measurement: m = (x, y, rho) with the bearing (x, y) on z = 1 and rho the
/// inverse depth [1/m]. Stereo noise is Gaussian in m at any depth, but not in the 3D point.
struct ImagePoint {
  Eigen::Vector3d m = Eigen::Vector3d::Zero();
  Eigen::Vector3d variance = Eigen::Vector3d::Ones();  ///< Independent variances of the entries of
                                                       ///< m.
  bool has_depth = false;

  /// Precondition: has_depth.
  [[nodiscard]] Eigen::Vector3d point() const {
    return {m.x() / m.z(), m.y() / m.z(), 1.0 / m.z()};
  }
};

[[nodiscard]] ImagePoint image_point(const KeyframeFeatures& features, std::size_t index,
                                     const ImageNoise& noise);

/// Error of a point of keyframe a, transformed into keyframe b by T_b_a, relative to the
/// measurement in b.
///
/// The homogeneous point (x, y, 1, rho) maps to h = R (x, y, 1) + rho t, which is the measurement
/// (h_x / h_z, h_y / h_z, rho / h_z) in b. The formula does not divide by the depth in a, so it is
/// stable for far points too. `information` is the inverse covariance of r, to first order from the
/// noise of both points. The minimum of chi2 is therefore the maximum of the likelihood over the
/// pose and the true points. If b has no depth, the third entry of r and its rows are zero.
struct TransferError {
  bool in_front = false;                        ///< False: behind camera b; other members unset.
  int dim = 0;                                  ///< 3 with depth on both sides, 2 if only a has it.
  Eigen::Vector3d r = Eigen::Vector3d::Zero();  ///< Predicted minus measured.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  double chi2 = 0.0;
  Eigen::Vector3d likely = Eigen::Vector3d::Zero();  ///< True m of a that fits both sides best.
};

/// Precondition: a.has_depth.
[[nodiscard]] TransferError transfer_error(const SE3& T_b_a, const ImagePoint& a,
                                           const ImagePoint& b);

/// Transfer error with the map linearised about `m` instead of a's measurement, for the
/// optimisation of the pose with m = transfer_error(T_b_a, a, b).likely. With a linearisation about
/// the measurement, residual and derivative contain the same noise. The estimated motion is then
/// too small, by the relative variance of the disparities ("attenuation", Fuller, "Measurement
/// Error Models", 1987).
[[nodiscard]] TransferError transfer_error(const SE3& T_b_a, const ImagePoint& a,
                                           const ImagePoint& b, const Eigen::Vector3d& m);

/// Derivative of the point m = (x, y, rho) of a, transferred into b, with respect to xi in
/// T_a_b * exp(xi). Precondition: in front.
[[nodiscard]] Eigen::Matrix<double, 3, 6> transfer_jacobian(const SE3& T_b_a,
                                                            const Eigen::Vector3d& m);

/// End of the sampling.
struct RansacOptions {
  double confidence = 0.999;  ///< Probability of having drawn one sample without outliers.
  int max_iterations = 2000;
};

/// The pose with the least cost, and the pairs that agree with it.
struct RansacResult {
  std::optional<SE3> T_a_b = {};          ///< Empty if no sample gave a pose.
  std::vector<std::size_t> inliers = {};  ///< Ascending.
  double cost = std::numeric_limits<double>::infinity();
  int iterations = 0;
};

/// T_a_b that minimises sum |p_a - T_a_b p_b|^2 in closed form (Arun, Huang, Blostein,
/// "Least-Squares Fitting of Two 3-D Point Sets", PAMI 1987, with the reflection resolved as in
/// their Sec. IV). nullopt if there are fewer than three points or they lie on a line, where the
/// rotation about it is free. Throws std::invalid_argument if the lengths differ.
[[nodiscard]] std::optional<SE3> align_points(std::span<const Eigen::Vector3d> points_a,
                                              std::span<const Eigen::Vector3d> points_b);

/// Two image points, presumably of one scene point. At least one has depth.
struct ImagePair {
  ImagePoint a;
  ImagePoint b;
};

/// Squared error of a pair in standard deviations and its degrees of freedom, measured from the
/// side that has depth (from a if both have).
struct PairError {
  double chi2 = 0.0;
  int dim = 0;  ///< 0: behind a camera.

  /// chi2 over the 99 % quantile of its distribution: at most 1 for an inlier.
  [[nodiscard]] double relative() const;
};

[[nodiscard]] PairError pair_error(const SE3& T_a_b, const ImagePair& pair);

/// A pose with the information matrix of its tangent.
struct PoseFit {
  SE3 T_a_b = SE3::Identity();
  Matrix6 information = Matrix6::Zero();  ///< Gauss-Newton, with robust weights.
  double chi2 = 0.0;                      ///< Weighted sum of the squared errors.
  double degrees_of_freedom = 0.0;        ///< Weighted number of residuals.
};

/// Minimises the transfer errors of `pairs[indices]` over the pose from `T_a_b` by Gauss-Newton
/// with Cauchy weights. nullopt if the pairs leave the pose undetermined or it does not converge to
/// finite numbers.
[[nodiscard]] std::optional<PoseFit> refine_pose(const SE3& T_a_b, std::span<const ImagePair> pairs,
                                                 std::span<const std::size_t> indices,
                                                 int max_iterations);

/// `fit.information` without the `share` of the pairs with the most information, at least two
/// pairs. The pairs are ranked by the trace of their information relative to the whole information.
/// If a few pairs decide a pose, perhaps wrong pairs that fit by chance, little information
/// remains.
[[nodiscard]] Matrix6 information_without_strongest(const PoseFit& fit,
                                                    std::span<const ImagePair> pairs,
                                                    std::span<const std::size_t> indices,
                                                    double share);

/// Relative pose of two stereo cameras from matches with outliers. Random sample consensus
/// (Fischler and Bolles, CACM 1981) with truncated costs (MSAC: Torr and Zisserman, "MLESAC", CVIU
/// 2000) and a local optimisation of each new best pose (Chum, Matas, Kittler, "Locally Optimized
/// RANSAC", DAGM 2003). The number of iterations adapts to the best share of inliers. Deterministic
/// by the state of `rng`.
///
/// A sample is Arun's method on three pairs with depth on both sides (as Chang et al.,
/// "Kimera-Multi", ICRA 2021, Sec. III-A), refined on the image errors, because bearings are much
/// more accurate than depths. pair_error() decides on inliers in the images, not by a metric
/// radius, so that far points count according to their accuracy.
[[nodiscard]] RansacResult ransac_pose(std::span<const ImagePair> pairs,
                                       const RansacOptions& options, std::mt19937& rng);

}  // namespace km
