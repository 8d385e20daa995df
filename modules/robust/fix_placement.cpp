#include "modules/robust/fix_placement.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "modules/core/stamp.hpp"
#include "modules/robust/robust_schedule.hpp"

namespace km {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kLargest_sigma = 4.0;  // 99.9 % of the distances of true fixes are shorter
constexpr double kDrift = 0.1;          // drift of odometry as a share of the distance
constexpr int kHypotheses = 300;
constexpr std::size_t kScored = 200;  // fixes that judge a hypothesis
constexpr std::size_t kLeastKept = 5;
constexpr double kIndependent = 10.0;  // largest number of fixes that count as independent
constexpr double kLargestRotationSigma_rad = 0.1;
constexpr double kGrowthOfMu = 1.4;  // Yang et al., RA-L 2020, Remark 5

struct Fixes {
  std::span<const PositionFix> fixes;
  Points q, p;  // points in the frame of the poses, and as measured
  std::vector<double> sigma_m;
  [[nodiscard]] std::size_t size() const { return q.size(); }
};

// T_datum_frame that minimises sum w |T q - p|^2 / sigma^2 (Umeyama, PAMI 1991, without scale).
SE3 aligned(const Fixes& f, std::span<const double> w, bool upright) {
  Eigen::Vector3d mean_q = Eigen::Vector3d::Zero(), mean_p = Eigen::Vector3d::Zero();
  double sum = 0.0;
  for (std::size_t k = 0; k < f.size(); ++k) {
    const double weight = w[k] / (f.sigma_m[k] * f.sigma_m[k]);
    mean_q += weight * f.q[k];
    mean_p += weight * f.p[k];
    sum += weight;
  }
  if (!(sum > 0.0)) return SE3::Identity();
  mean_q /= sum;
  mean_p /= sum;
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < f.size(); ++k)
    C += w[k] / (f.sigma_m[k] * f.sigma_m[k]) * (f.p[k] - mean_p) * (f.q[k] - mean_q).transpose();
  Eigen::Matrix3d R;
  if (upright) {
    const double heading = std::atan2(C(1, 0) - C(0, 1), C(0, 0) + C(1, 1));
    R = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  } else {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(C, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs = Eigen::Vector3d::Ones();
    signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  }
  return make_pose(R, mean_p - R * mean_q);
}

// Sum of the truncated squared distances of fixes, in units of their tolerance. The tolerance grows
// with the distance from the fixes that made the hypothesis.
double cost_of(const Fixes& f, const SE3& T_datum_frame, std::span<const std::size_t> made_by) {
  const std::size_t stride = 1 + f.size() / kScored;
  double cost = 0.0;
  for (std::size_t k = 0; k < f.size(); k += stride) {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const std::size_t m : made_by) nearest_m = std::min(nearest_m, (f.q[k] - f.q[m]).norm());
    const double drift_m = made_by.empty() ? 0.0 : kDrift * nearest_m;
    const double tolerance_m = std::hypot(kLargest_sigma * f.sigma_m[k], drift_m);
    const double r = (T_datum_frame * f.q[k] - f.p[k]).norm() / tolerance_m;
    cost += std::min(1.0, r * r);
  }
  return cost;
}

SE3 best_hypothesis(const Fixes& f, bool upright) {
  std::mt19937 rng(1);
  SE3 best = SE3::Identity();
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> w(f.size(), 0.0);
  for (int h = 0; h < kHypotheses; ++h) {
    std::vector<std::size_t> sample;
    for (int k = 0; k < (upright ? 2 : 3); ++k) sample.push_back(rng() % f.size());
    for (const std::size_t k : sample) w[k] = 1.0;
    const SE3 T = aligned(f, w, upright);
    for (const std::size_t k : sample) w[k] = 0.0;
    const double cost = cost_of(f, T, sample);
    if (!(cost < least)) continue;
    least = cost;
    best = T;
  }
  return best;
}

// Least-squares offsets y of the measured offsets m, with weights w / sigma^2, along a random walk
// with the variances `walk` (of the step from fix k to k + 1). A tridiagonal system.
Points smoothed(const Points& m, std::span<const double> information,
                std::span<const double> walk) {
  const std::size_t n = m.size();
  std::vector<double> diagonal(n), above(n, 0.0);
  Points y(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double before = k > 0 ? 1.0 / walk[k - 1] : 0.0;
    const double after = k + 1 < n ? 1.0 / walk[k] : 0.0;
    // Positive also if no fix counts: the offset is then arbitrary.
    diagonal[k] = std::max(information[k], 1e-12) + before + after;
    y[k] = information[k] * m[k];
    above[k] = -after;
    if (k == 0) continue;
    const double factor = above[k - 1] / diagonal[k - 1];
    diagonal[k] -= factor * above[k - 1];
    y[k] -= factor * y[k - 1];
  }
  y[n - 1] /= diagonal[n - 1];
  for (std::size_t k = n - 1; k-- > 0;) y[k] = (y[k] - above[k] * y[k + 1]) / diagonal[k];
  return y;
}

// Graduated non-convexity on the fixes (Yang et al., RA-L 2020, Algorithm 1).
std::vector<bool> consistent(const Fixes& f, const SE3& T_datum_frame,
                             std::span<const double> walk) {
  constexpr double kBarc2 = kLargest_sigma * kLargest_sigma;
  const std::size_t n = f.size();
  Points m(n);
  std::vector<double> information(n), r2(n), w(n, 1.0);
  for (std::size_t k = 0; k < n; ++k)
    m[k] = f.p[k] - T_datum_frame.linear() * f.q[k] - T_datum_frame.translation();
  const auto solve = [&] {
    for (std::size_t k = 0; k < n; ++k) information[k] = w[k] / (f.sigma_m[k] * f.sigma_m[k]);
    const Points y = smoothed(m, information, walk);
    for (std::size_t k = 0; k < n; ++k)
      r2[k] = (m[k] - y[k]).squaredNorm() / (f.sigma_m[k] * f.sigma_m[k]);
  };
  solve();
  for (double mu = first_mu(*std::ranges::max_element(r2), kBarc2); mu < kHardMu;
       mu *= kGrowthOfMu) {
    for (std::size_t k = 0; k < n; ++k) w[k] = robust_weight(r2[k], kBarc2, mu);
    solve();
  }
  std::vector<bool> kept(n);
  for (std::size_t k = 0; k < n; ++k) kept[k] = r2[k] <= kBarc2;
  return kept;
}

// The share of each kept fix in the information of all: 1 over the sum of its correlations with the
// kept fixes, 0 if it is not kept. The sum of the shares is then the number of independent fixes:
// the variance of the mean of many equally spaced fixes is sigma^2 over this sum.
std::vector<double> shares_of(std::span<const PositionFix> fixes, const std::vector<bool>& kept) {
  const std::size_t n = fixes.size();
  std::vector<double> sum(n, 0.0);
  const auto add_earlier = [&](auto index_of) {
    double earlier = 0.0;  // sum of the correlations of the fix before with itself and earlier ones
    std::size_t before = n;
    for (std::size_t step = 0; step < n; ++step) {
      const std::size_t k = index_of(step);
      if (!kept[k]) continue;
      if (before < n && fixes[k].correlation_s > 0.0)
        earlier *= std::exp(-std::abs(seconds_between(fixes[before].stamp, fixes[k].stamp)) /
                            fixes[k].correlation_s);
      else
        earlier = 0.0;
      sum[k] += earlier;
      earlier += 1.0;
      before = k;
    }
  };
  add_earlier([](std::size_t step) { return step; });
  add_earlier([n](std::size_t step) { return n - 1 - step; });
  for (std::size_t k = 0; k < n; ++k) sum[k] = kept[k] ? 1.0 / (1.0 + sum[k]) : 0.0;
  return sum;
}

// Information of the rotation between both frames, from the spread of the kept points.
double rotation_sigma(const Fixes& f, std::span<const double> shares, bool upright) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const double independent = std::accumulate(shares.begin(), shares.end(), 0.0);
  if (independent == 0.0) return std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < f.size(); ++k) mean += shares[k] / independent * f.q[k];
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < f.size(); ++k) {
    const Eigen::Vector3d a = f.q[k] - mean;
    H += shares[k] * (a.squaredNorm() * Eigen::Matrix3d::Identity() - a * a.transpose()) /
         (f.sigma_m[k] * f.sigma_m[k]);
  }
  H *= std::min(1.0, kIndependent / std::max(1.0, independent));
  const double least = upright ? H(2, 2) : H.selfadjointView<Eigen::Lower>().eigenvalues()(0);
  return 1.0 / std::sqrt(std::max(least, 0.0));
}

FixPlacement judge(const Fixes& f, const SE3& T_datum_frame, std::span<const double> walk,
                   bool upright) {
  FixPlacement placement{.T_frame_datum = T_datum_frame.inverse(),
                         .kept = consistent(f, T_datum_frame, walk),
                         .state = {}};
  FixesState& state = placement.state;
  state.used = static_cast<std::uint32_t>(std::ranges::count(placement.kept, true));
  state.rejected = static_cast<std::uint32_t>(f.size()) - state.used;
  state.rotation_sigma_rad = rotation_sigma(f, shares_of(f.fixes, placement.kept), upright);
  state.located = state.used >= kLeastKept && state.used > state.rejected &&
                  state.rotation_sigma_rad <= kLargestRotationSigma_rad;
  return placement;
}

}  // namespace

FixPlacement place_fixes(std::span<const PositionFix> fixes, std::span<const SE3> T_frame_kf,
                         const Precision& step, bool upright) {
  Fixes f{.fixes = fixes, .q = {}, .p = {}, .sigma_m = {}};
  std::vector<double> walk;  // variances
  for (const PositionFix& fix : fixes) {
    f.q.push_back(T_frame_kf[fix.keyframe.index] * fix.p_kf);
    f.p.push_back(fix.p_datum);
    f.sigma_m.push_back(fix.sigma_m);
    if (f.size() == 1) continue;
    const auto steps = static_cast<double>(fix.keyframe.index - (&fix)[-1].keyframe.index);
    const double drift_m = kDrift * (f.q.back() - f.q[f.size() - 2]).norm();
    walk.push_back(std::max(1.0, steps) / step.tau + drift_m * drift_m);
  }
  FixPlacement found = judge(f, best_hypothesis(f, upright), walk, upright);
  for (int repetition = 0; repetition < 2; ++repetition) {
    const std::vector<double> w(found.kept.begin(), found.kept.end());
    found = judge(f, aligned(f, w, upright), walk, upright);
  }
  return found;
}

std::vector<PoseEdge> fix_edges(std::span<const PositionFix> fixes, const std::vector<bool>& kept,
                                std::span<const SE3> T_frame_kf) {
  constexpr double kNoRotation = 1e-9;  // [1/rad^2], positive so that the edge is usable
  const std::vector<double> shares = shares_of(fixes, kept);
  std::vector<PoseEdge> edges;
  for (std::size_t k = 0; k < fixes.size(); ++k) {
    if (!kept[k]) continue;
    const PositionFix& fix = fixes[k];
    const Eigen::Matrix3d R_0_kf =
        T_frame_kf[0].linear().transpose() * T_frame_kf[fix.keyframe.index].linear();
    edges.push_back({{fix.keyframe.robot, 0},
                     fix.keyframe,
                     make_pose(R_0_kf, fix.p_datum - R_0_kf * fix.p_kf),
                     {kNoRotation, shares[k] / (fix.sigma_m * fix.sigma_m)}});
  }
  return edges;
}

}  // namespace km
