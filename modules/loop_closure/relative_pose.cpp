#include "modules/loop_closure/relative_pose.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "modules/core/geometry/lie.hpp"
#include "modules/images/keypoint_extractor.hpp"

namespace km {
namespace {

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

// Least ratio of the second to the first singular value of Arun's H, a ratio of variances. Points
// with a smaller ratio lie on a line within their noise.
constexpr double kLeastSpread = 1e-4;

// 99 % quantiles of the chi-squared distribution with 2 and 3 degrees of freedom.
constexpr double kQuantile2 = 9.210;
constexpr double kQuantile3 = 11.345;

// Numbers of Gauss-Newton steps on a minimal sample and on the inliers of a new best model.
constexpr int kSampleSteps = 2;
constexpr int kPolishSteps = 3;

double quantile(int dim) {
  return dim == 3 ? kQuantile3 : kQuantile2;
}

// Variance of a point along its ray: that of the inverse depth times (d|p| / d rho)^2.
double range_variance(const ImagePoint& point) {
  const double z = 1.0 / point.m.z();
  return z * z * z * z * point.variance.z() * (1.0 + point.m.head<2>().squaredNorm());
}

// Sums of Gauss-Newton with Cauchy weights.
struct NormalEquations {
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double chi2 = 0.0;
  double degrees_of_freedom = 0.0;
};

NormalEquations linearise(const SE3& T_a_b, std::span<const ImagePair> pairs,
                          std::span<const std::size_t> indices) {
  NormalEquations sum;
  const SE3 T_b_a = T_a_b.inverse();
  const Matrix6 Ad = adjoint(T_a_b);
  for (const std::size_t i : indices) {
    const ImagePair& pair = pairs[i];
    const bool from_a = pair.a.has_depth;
    const SE3& T = from_a ? T_b_a : T_a_b;
    const ImagePoint& first = from_a ? pair.a : pair.b;
    const ImagePoint& second = from_a ? pair.b : pair.a;
    const TransferError measured = transfer_error(T, first, second);
    if (!measured.in_front) continue;
    const TransferError error = transfer_error(T, first, second, measured.likely);
    if (!error.in_front) continue;
    // The transfer from b to a depends on T_a_b. xi changes T_b_a on its right by -Ad(T_a_b) xi.
    Eigen::Matrix<double, 3, 6> J = transfer_jacobian(T, measured.likely);
    if (!from_a) J = -J * Ad;
    const double weight = 1.0 / (1.0 + error.chi2 / quantile(error.dim));
    const Eigen::Matrix<double, 6, 3> JtW = weight * J.transpose() * error.information;
    sum.H += JtW * J;
    sum.g += JtW * error.r;
    sum.chi2 += weight * error.chi2;
    sum.degrees_of_freedom += weight * error.dim;
  }
  return sum;
}

// True if the transfer error of m = a.m exceeds its quantile along one axis. It then exceeds it as
// a whole: r' Sigma^-1 r is the maximum of (u' r)^2 / (u' Sigma u) over all directions u. Takes a
// fraction of the time of transfer_error(), and most pairs are far from most models.
bool is_outlier_along_an_axis(const SE3& T_b_a, const ImagePoint& a, const ImagePoint& b) {
  const Eigen::Vector3d h = carried(T_b_a, a.m);
  if (!(h.z() > kLeastDepthRatio)) return true;
  const double s = 1.0 / h.z();
  const Eigen::Vector3d at = s * Eigen::Vector3d(h.x(), h.y(), a.m.z());
  const auto dh_dm = [&T_b_a](int row) -> Eigen::RowVector3d {
    return {T_b_a(row, 0), T_b_a(row, 1), T_b_a(row, 3)};
  };
  const Eigen::RowVector3d dz = dh_dm(2);
  const int dim = b.has_depth ? 3 : 2;
  for (int axis = 0; axis < dim; ++axis) {
    Eigen::RowVector3d g = -at[axis] * dz;
    g += axis < 2 ? dh_dm(axis) : Eigen::RowVector3d::UnitZ();
    const double variance = s * s * g.cwiseAbs2().dot(a.variance.transpose()) + b.variance[axis];
    const double r = at[axis] - b.m[axis];
    if (!(r * r <= quantile(dim) * variance)) return true;
  }
  return false;
}

// Three pairs with depth on both sides. A sample is solved only if the sides of its two triangles
// have equal lengths.
class ThreePointProblem {
 public:
  static constexpr std::size_t kSampleSize = 3;

  explicit ThreePointProblem(std::span<const ImagePair> pairs) : pairs_(pairs) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto& [a, b] = pairs[i];
      if (a.has_depth && b.has_depth)
        solid_.push_back({a.point(), b.point(), range_variance(a) + range_variance(b), i});
    }
  }

  std::size_t drawable() const { return solid_.size(); }

  std::optional<SE3> solve(std::span<const std::size_t> sample) const {
    std::array<Eigen::Vector3d, 3> a, b;
    std::array<std::size_t, 3> indices;
    for (std::size_t k = 0; k < 3; ++k) {
      const Solid& s = solid_[sample[k]];
      for (std::size_t l = 0; l < k; ++l)
        if (!same_length(s, solid_[sample[l]])) return std::nullopt;
      a[k] = s.a;
      b[k] = s.b;
      indices[k] = s.pair;
    }
    const std::optional<SE3> T_a_b = align_points(a, b);
    if (!T_a_b) return std::nullopt;
    const std::optional<PoseFit> fit = refine_pose(*T_a_b, pairs_, indices, kSampleSteps);
    return fit ? fit->T_a_b : *T_a_b;
  }

  double error(const SE3& T_a_b, std::size_t i) const {
    constexpr double kOutlier = 2.0;
    const auto& [a, b] = pairs_[i];
    const bool is_outlier = a.has_depth ? is_outlier_along_an_axis(T_a_b.inverse(), a, b)
                                        : is_outlier_along_an_axis(T_a_b, b, a);
    return is_outlier ? kOutlier : pair_error(T_a_b, pairs_[i]).relative();
  }

 private:
  struct Solid {
    Eigen::Vector3d a, b;
    double range_variance;  // sum over both points
    std::size_t pair;
  };

  static bool same_length(const Solid& s, const Solid& t) {
    const double difference = (s.a - t.a).norm() - (s.b - t.b).norm();
    constexpr double kSigmas = 3.0;
    return difference * difference <= kSigmas * kSigmas * (s.range_variance + t.range_variance);
  }

  std::span<const ImagePair> pairs_;
  std::vector<Solid> solid_;
};

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

std::optional<SE3> align_points(std::span<const Eigen::Vector3d> points_a,
                                std::span<const Eigen::Vector3d> points_b) {
  if (points_a.size() != points_b.size())
    throw std::invalid_argument("align_points: " + std::to_string(points_a.size()) +
                                " points and " + std::to_string(points_b.size()));
  if (points_a.size() < 3) return std::nullopt;
  const auto n = static_cast<double>(points_a.size());
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    mean_a += points_a[i] / n;
    mean_b += points_b[i] / n;
  }
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < points_a.size(); ++i)
    H += (points_b[i] - mean_b) * (points_a[i] - mean_a).transpose();

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& s = svd.singularValues();
  if (!(s(1) > kLeastSpread * s(0))) return std::nullopt;
  Eigen::Matrix3d V = svd.matrixV();
  if ((V * svd.matrixU().transpose()).determinant() < 0.0) V.col(2) *= -1.0;
  const Eigen::Matrix3d R_a_b = V * svd.matrixU().transpose();
  return make_pose(R_a_b, mean_a - R_a_b * mean_b);
}

double PairError::relative() const {
  constexpr double kBehind = 1e9;
  return dim == 0 ? kBehind : chi2 / quantile(dim);
}

PairError pair_error(const SE3& T_a_b, const ImagePair& pair) {
  const TransferError error = pair.a.has_depth ? transfer_error(T_a_b.inverse(), pair.a, pair.b)
                                               : transfer_error(T_a_b, pair.b, pair.a);
  return {error.chi2, error.in_front ? error.dim : 0};
}

std::optional<PoseFit> refine_pose(const SE3& T_a_b, std::span<const ImagePair> pairs,
                                   std::span<const std::size_t> indices, int max_iterations) {
  constexpr double kConverged = 1e-7;  // [rad], [m]
  PoseFit fit;
  fit.T_a_b = T_a_b;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const NormalEquations equations = linearise(fit.T_a_b, pairs, indices);
    const Eigen::LDLT<Matrix6> ldlt(equations.H);
    constexpr double kLeastPivotRatio = 1e-12;
    const auto pivots = ldlt.vectorD();
    if (ldlt.info() != Eigen::Success ||
        !(pivots.minCoeff() > kLeastPivotRatio * pivots.maxCoeff()))
      return std::nullopt;
    const Vector6 xi = -ldlt.solve(equations.g);
    if (!xi.allFinite()) return std::nullopt;
    fit.T_a_b = fit.T_a_b * se3_exp(xi);
    if (xi.norm() < kConverged) break;
  }
  fit.T_a_b.linear() = nearest_rotation(fit.T_a_b.linear());
  const NormalEquations equations = linearise(fit.T_a_b, pairs, indices);
  fit.information = equations.H;
  fit.chi2 = equations.chi2;
  fit.degrees_of_freedom = equations.degrees_of_freedom;
  return fit;
}

Matrix6 information_without_strongest(const PoseFit& fit, std::span<const ImagePair> pairs,
                                      std::span<const std::size_t> indices, double share) {
  const Eigen::LDLT<Matrix6> whole(fit.information);
  struct Part {
    double strength;
    Matrix6 H;
  };
  std::vector<Part> parts;
  parts.reserve(indices.size());
  for (const std::size_t& i : indices) {
    const Matrix6 H = linearise(fit.T_a_b, pairs, {&i, 1}).H;
    parts.push_back({whole.solve(H).trace(), H});
  }
  const auto wanted = static_cast<std::size_t>(share * static_cast<double>(parts.size()));
  const std::size_t taken = std::min(std::max<std::size_t>(wanted, 2), parts.size());
  std::partial_sort(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(taken), parts.end(),
                    [](const Part& l, const Part& r) { return l.strength > r.strength; });
  Matrix6 left = Matrix6::Zero();
  for (std::size_t i = taken; i < parts.size(); ++i) left += parts[i].H;
  return left;
}

RansacResult ransac_pose(std::span<const ImagePair> pairs, const RansacOptions& options,
                         std::mt19937& rng) {
  const ThreePointProblem problem(pairs);
  RansacResult best;
  const std::size_t n = pairs.size();
  const std::size_t drawable = problem.drawable();
  if (drawable < ThreePointProblem::kSampleSize) return best;

  const auto consider = [&](const SE3& T_a_b) {
    double cost = 0.0;
    std::vector<std::size_t> inliers;
    for (std::size_t i = 0; i < n && cost < best.cost; ++i) {
      const double error = problem.error(T_a_b, i);
      const bool is_inlier = error <= 1.0;
      if (is_inlier) inliers.push_back(i);
      cost += is_inlier ? error : 1.0;
    }
    if (!(cost < best.cost)) return false;
    best.T_a_b = T_a_b;
    best.cost = cost;
    best.inliers = std::move(inliers);
    return true;
  };

  std::uniform_int_distribution<std::size_t> draw(0, drawable - 1);
  double needed = options.max_iterations;
  for (; best.iterations < needed; ++best.iterations) {
    std::array<std::size_t, ThreePointProblem::kSampleSize> sample;
    for (std::size_t k = 0; k < sample.size();) {
      sample[k] = draw(rng);
      if (std::find(sample.begin(), sample.begin() + k, sample[k]) == sample.begin() + k) ++k;
    }
    const std::optional<SE3> T_a_b = problem.solve(sample);
    if (!T_a_b || !consider(*T_a_b)) continue;
    const auto polished = refine_pose(*best.T_a_b, pairs, best.inliers, kPolishSteps);
    if (polished) consider(polished->T_a_b);
    const double share = static_cast<double>(best.inliers.size()) / static_cast<double>(n);
    const double clean = std::pow(share, static_cast<double>(sample.size()));
    const double adapted =
        std::log1p(-options.confidence) / std::log1p(-std::min(clean, 1 - 1e-12));
    if (clean > 0.0) needed = std::min(needed, std::ceil(adapted));
  }
  return best;
}

}  // namespace km
