#include "modules/surface_ties/surface_tie.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <optional>

#include "modules/core/lie.hpp"
#include "modules/core/symmetric_eigen.hpp"

namespace km {
namespace {

constexpr double kLeastCosine = 0.5;     // between the normals of a pair: 60 degrees
constexpr std::size_t kNeighbours = 8;   // candidates for the partner of a sample
constexpr std::size_t kLeastPairs = 60;  // 1.35 m^2 at the default spacing
constexpr double kLeastFitting = 0.6;    // share of the common samples
constexpr double kShrink = 0.8;          // factor on the gate from one iteration to the next
constexpr double kGate_sigmas = 3.0;     // final gate
constexpr double kPerMad = 1.4826;       // standard deviation over median absolute residual
constexpr int kMaxIterations = 40;
constexpr double kStop_m = 1e-5;          // step that ends the iterations
constexpr double kFreeVariance_m2 = 1e4;  // variance of a direction in which surfaces slide
// Share of the pairs' weight below which a direction is free. Normals that err by 8 degrees give
// the direction along a corridor a share of 0.02.
constexpr double kOpen = 0.03;

struct SampleCloud {
  const std::vector<SurfaceSample>& samples;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return samples.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return samples[i].point[static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

using SampleTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, SampleCloud>,
                                        SampleCloud, 3, std::uint32_t>;

// Pairs at one guess: all samples of b with a copy in a within reach.
struct Pairing {
  std::vector<SurfacePair> pairs;
  std::vector<double> residuals;  // NaN: the labels of the pair differ
};

class Matcher {
 public:
  Matcher(const std::vector<SurfaceSample>& a, const std::vector<SurfaceSample>& b,
          const SurfaceTieOptions& options)
      : a_(a), b_(b), options_(options), cloud_{a}, tree_(3, cloud_) {}

  [[nodiscard]] Pairing match(const SE3& T_a_b) const {
    Pairing result;
    for (const SurfaceSample& sample : b_) {
      const auto partner = partner_of(
          {T_a_b * sample.point, T_a_b.linear() * sample.normal, sample.label, sample.seen_by});
      if (!partner) continue;
      const bool differ =
          partner->label != 0 && sample.label != 0 && partner->label != sample.label;
      result.pairs.push_back({sample.point, partner->point, partner->normal});
      result.residuals.push_back(differ ? std::numeric_limits<double>::quiet_NaN()
                                        : residual_of(result.pairs.back(), T_a_b));
    }
    return result;
  }

 private:
  // The nearest sample of a that faces the same way, is not of the same visit, and does not lie
  // beside the moved sample of b.
  [[nodiscard]] std::optional<SurfaceSample> partner_of(const SurfaceSample& moved) const {
    std::array<std::uint32_t, kNeighbours> found{};
    std::array<double, kNeighbours> distances2{};
    const std::size_t count =
        tree_.knnSearch(moved.point.data(), kNeighbours, found.data(), distances2.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (distances2[i] > options_.reach_m * options_.reach_m) break;
      const SurfaceSample& candidate = a_[found[i]];
      if (candidate.normal.dot(moved.normal) < kLeastCosine || is_one_visit(candidate, moved))
        continue;
      const Eigen::Vector3d offset = moved.point - candidate.point;
      const double along2 = offset.squaredNorm() - std::pow(candidate.normal.dot(offset), 2);
      if (along2 <= options_.spacing_m * options_.spacing_m) return candidate;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool is_one_visit(const SurfaceSample& a, const SurfaceSample& b) const {
    return options_.max_gap_keyframes &&
           keyframe_gap(a.seen_by, b.seen_by) <= *options_.max_gap_keyframes;
  }

  const std::vector<SurfaceSample>& a_;
  const std::vector<SurfaceSample>& b_;
  const SurfaceTieOptions& options_;
  SampleCloud cloud_;
  SampleTree tree_;
};

double noise_of(const Pairing& pairing, const SurfaceTieOptions& options) {
  std::vector<double> lengths;
  for (const double residual : pairing.residuals)
    if (!std::isnan(residual)) lengths.push_back(std::abs(residual));
  if (lengths.empty()) return options.min_noise_m;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return std::max(kPerMad * *middle, options.min_noise_m);
}

// Weights of the pairs: Tukey's biweight of the residual, 0 beyond the gate.
std::vector<double> robust_weights(const Pairing& pairing, double gate_m) {
  std::vector<double> weights;
  for (const double residual : pairing.residuals) {
    const double share = residual / gate_m;
    weights.push_back(std::abs(share) < 1.0 ? std::pow(1.0 - share * share, 2) : 0.0);
  }
  return weights;
}

// Normal equations of the pairs, about their centre. Rotations are expressed as the distance that
// they move a point at the typical radius. All six unknowns are then lengths, so that eigenvalues
// show which directions the surfaces determine.
class NormalEquations {
 public:
  NormalEquations(const Pairing& pairing, const SE3& T_a_b, double gate_m) {
    const std::vector<double> weights = robust_weights(pairing, gate_m);
    locate(pairing, weights);
    for (std::size_t i = 0; i < weights.size(); ++i) {
      if (weights[i] == 0.0) continue;
      const Vector6 J = from_scaled().transpose() * jacobian_of(pairing.pairs[i], T_a_b);
      H_ += weights[i] * J * J.transpose();
      g_ += weights[i] * pairing.residuals[i] * J;
      sum_ += weights[i] * J;
    }
    eigen_ = symmetric_eigen(H_);
  }

  [[nodiscard]] double weight() const { return weight_; }
  [[nodiscard]] bool is_free(int direction) const {
    return eigen_.values[direction] < kOpen * weight_;
  }
  [[nodiscard]] int free_directions() const {
    int count = 0;
    for (int i = 0; i < 6; ++i) count += is_free(i) ? 1 : 0;
    return count;
  }

  // The step of the scaled unknowns; zero along free directions.
  [[nodiscard]] Vector6 step() const { return -(inverse(0.0) * g_); }

  // Covariance of the tangent of T_a_b: independent errors of `variance` each for a unit of weight,
  // and an error of all residuals with `bias_variance`.
  [[nodiscard]] Matrix6 covariance(double variance, double bias_variance) const {
    const Vector6 biased = inverse(0.0) * sum_;
    Matrix6 Sigma = variance * inverse(kFreeVariance_m2 / variance);
    Sigma += bias_variance * biased * biased.transpose();
    Sigma = from_scaled() * Sigma * from_scaled().transpose();
    return 0.5 * (Sigma + Sigma.transpose());
  }

  // Tangent of T_a_b from the scaled unknowns [radius * rotation; motion of the centre].
  [[nodiscard]] Matrix6 from_scaled() const {
    Matrix6 M = Matrix6::Identity();
    M.topLeftCorner<3, 3>() /= radius_m_;
    M.bottomLeftCorner<3, 3>() = skew(centre_b_) / radius_m_;
    return M;
  }

 private:
  void locate(const Pairing& pairing, const std::vector<double>& weights) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
      weight_ += weights[i];
      centre_b_ += weights[i] * pairing.pairs[i].point_b;
    }
    if (weight_ <= 0.0) return;
    centre_b_ /= weight_;
    double radius2 = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i)
      radius2 += weights[i] * (pairing.pairs[i].point_b - centre_b_).squaredNorm();
    radius_m_ = std::max(std::sqrt(radius2 / weight_), 1e-3);
  }

  // Inverse of H, with the eigenvalue `free` along free directions.
  [[nodiscard]] Matrix6 inverse(double free) const {
    Vector6 values;
    for (int i = 0; i < 6; ++i) values[i] = is_free(i) ? free : 1.0 / eigen_.values[i];
    const Matrix6 V = eigen_.vectors;
    return V * values.asDiagonal() * V.transpose();
  }

  double weight_ = 0.0;
  Eigen::Vector3d centre_b_ = Eigen::Vector3d::Zero();
  double radius_m_ = 1.0;
  Matrix6 H_ = Matrix6::Zero();
  Vector6 g_ = Vector6::Zero();
  Vector6 sum_ = Vector6::Zero();  // gradient of an offset that all residuals share
  SymmetricEigen eigen_;           // eigenvalues and eigenvectors of H
};

// The share of the pairs within the gate, in the direction in which it is smallest: the smallest
// eigenvalue of H_fitting relative to H_all. If two opposite walls contradict each other, half of
// the pairs fit in the direction of their normals, however many fit on the floor.
double fitting_share(const Pairing& pairing, const SE3& T_a_b, const Matrix6& from_scaled,
                     double gate_m) {
  Matrix6 all = Matrix6::Zero(), fitting = Matrix6::Zero();
  for (std::size_t i = 0; i < pairing.pairs.size(); ++i) {
    const Vector6 J = from_scaled.transpose() * jacobian_of(pairing.pairs[i], T_a_b);
    all += J * J.transpose();
    if (std::abs(pairing.residuals[i]) < gate_m) fitting += J * J.transpose();
  }
  // In directions in which the surfaces slide, nothing is to be compared.
  const Matrix6 floor = kOpen * static_cast<double>(pairing.pairs.size()) * Matrix6::Identity();
  const Matrix6 L_inverse = (all + floor).llt().matrixL().solve(Matrix6::Identity());
  return symmetric_eigen(L_inverse * (fitting + floor) * L_inverse.transpose()).values[0];
}

// Fills in what follows from the pairs at the registered pose. Those within the gate fit.
void judge(SurfaceTie& tie, const Pairing& pairing, double gate_m,
           const SurfaceTieOptions& options) {
  double sum2 = 0.0;
  for (const double residual : pairing.residuals)
    if (std::abs(residual) < gate_m) {
      ++tie.pairs;
      sum2 += residual * residual;
    }
  if (tie.pairs < kLeastPairs) return;
  const NormalEquations equations(pairing, tie.T_a_b, gate_m);
  tie.fitting = fitting_share(pairing, tie.T_a_b, equations.from_scaled(), gate_m);
  tie.noise_m = std::max(std::sqrt(sum2 / static_cast<double>(tie.pairs)), options.min_noise_m);
  if (tie.fitting < kLeastFitting || tie.noise_m > options.max_noise_m) {
    tie.status = SurfaceTieStatus::kMisfit;
    return;
  }
  tie.free_directions = equations.free_directions();
  tie.status = tie.free_directions == 0 ? SurfaceTieStatus::kTied : SurfaceTieStatus::kSlides;
  tie.covariance = equations.covariance(options.samples_per_error() * tie.noise_m * tie.noise_m,
                                        options.bias_m * options.bias_m);
}

}  // namespace

const char* to_string(SurfaceTieStatus status) {
  switch (status) {
    case SurfaceTieStatus::kTied:
      return "tied";
    case SurfaceTieStatus::kSlides:
      return "slides";
    case SurfaceTieStatus::kTooLittle:
      return "too little";
    case SurfaceTieStatus::kMisfit:
      return "misfit";
  }
  return "unknown";
}

double residual_of(const SurfacePair& pair, const SE3& T_a_b) {
  return pair.normal_a.dot(T_a_b * pair.point_b - pair.plane_a);
}

Vector6 jacobian_of(const SurfacePair& pair, const SE3& T_a_b) {
  const Eigen::Vector3d normal_b = T_a_b.linear().transpose() * pair.normal_a;
  Vector6 J;
  J << pair.point_b.cross(normal_b), normal_b;
  return J;
}

SurfaceTie tie_surfaces(const std::vector<SurfaceSample>& a, const std::vector<SurfaceSample>& b,
                        const SE3& T_a_b, const SurfaceTieOptions& options) {
  SurfaceTie tie;
  tie.T_a_b = T_a_b;
  if (a.size() < kLeastPairs || b.size() < kLeastPairs) return tie;
  const Matcher matcher(a, b, options);
  Pairing pairing = matcher.match(tie.T_a_b);
  double schedule_m = options.reach_m, gate_m = options.reach_m;
  for (int i = 0; i < kMaxIterations && pairing.pairs.size() >= kLeastPairs; ++i) {
    const double final_m = kGate_sigmas * noise_of(pairing, options);
    gate_m = std::clamp(schedule_m, std::min(final_m, options.reach_m), options.reach_m);
    const NormalEquations equations(pairing, tie.T_a_b, gate_m);
    const Vector6 step = equations.step();
    tie.T_a_b = retract(tie.T_a_b, equations.from_scaled() * step);
    pairing = matcher.match(tie.T_a_b);
    if (step.norm() < kStop_m && schedule_m <= final_m) break;
    schedule_m *= kShrink;
  }
  if (pairing.pairs.size() >= kLeastPairs) judge(tie, pairing, gate_m, options);
  return tie;
}

}  // namespace km
