#include "modules/pose_graph/robust/noise_scale.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "modules/core/covariance.hpp"
#include "modules/core/lie.hpp"
#include "modules/pose_graph/robust/gnc_edges.hpp"

namespace km {
namespace {

using Eigen::Index;

constexpr Index kSteps = 10;  // of odometry in a cycle, at most
constexpr double kLargestTurn = 0.25 * std::numbers::pi;
constexpr std::size_t kFewPairs = 5;
constexpr std::size_t kEnoughPairs = 2000;

// Lengths, and scales, are told apart to 5 %.
constexpr double kBin = 0.05;  // of log d
constexpr double kLeast = 1e-4;
constexpr double kGreatest = 1e3;
constexpr double kLeastScale = 1e-3;
constexpr double kGreatestScale = 100.0;
constexpr int kIterations = 40;

using Histogram = std::vector<double>;

std::size_t bin_of(double length) {
  return static_cast<std::size_t>(std::log(std::clamp(length, kLeast, kGreatest) / kLeast) / kBin);
}

double middle_of(std::size_t bin) {
  return kLeast * std::exp(kBin * (static_cast<double>(bin) + 0.5));
}

// Density of log |x| for a normal vector x with so many components.
double log_length_density(double length, int components) {
  const double k = components;
  return std::exp(k * std::log(length) - 0.5 * length * length -
                  (0.5 * k - 1.0) * std::numbers::ln2 - std::lgamma(0.5 * k));
}

struct Fit {
  double share = 0.5;
  double log_likelihood = 0.0;
};

// Share of the lengths that are noise of this scale, the others being of any.
Fit fit(const Histogram& counts, double total, double scale, int components) {
  const double any = 1.0 / std::log(kGreatest / kLeast);
  std::vector<double> noise(counts.size());
  for (std::size_t b = 0; b < counts.size(); ++b)
    noise[b] = log_length_density(middle_of(b) / scale, components);
  Fit fit;
  for (int i = 0; i < kIterations; ++i) {
    double sum = 0.0;
    for (std::size_t b = 0; b < counts.size(); ++b)
      if (counts[b] > 0.0)
        sum += counts[b] * fit.share * noise[b] /
               (fit.share * noise[b] + (1.0 - fit.share) * any + 1e-300);
    fit.share = sum / total;
  }
  for (std::size_t b = 0; b < counts.size(); ++b)
    if (counts[b] > 0.0)
      fit.log_likelihood +=
          counts[b] * std::log(fit.share * noise[b] + (1.0 - fit.share) * any + 1e-300);
  return fit;
}

// A closure from its lower pose to its upper one.
struct UpwardClosure {
  Index lower = 0;
  Index upper = 0;
  UncertainPose T_lower_upper;
};

// Places of two closures, and the steps of odometry between them.
struct ClosurePair {
  std::size_t a = 0;
  std::size_t b = 0;
  Index steps = 0;
};

class Cycles {
 public:
  Cycles(const TeamGraph& graph, const std::vector<bool>& odometry)
      : graph_(graph), step_(static_cast<std::size_t>(graph.poses())) {
    for (std::size_t k = 0; k < graph.edges.size(); ++k) {
      const BlockEdge& e = graph.edges[k];
      const UncertainPose T_i_j{e.T_i_j, edge_covariance(e, graph.dimension)};
      if (odometry[k]) {
        if (e.j == e.i + 1) step_[static_cast<std::size_t>(e.i)] = T_i_j;
      } else if (e.i < e.j) {
        closures_.push_back({e.i, e.j, T_i_j});
      } else {
        closures_.push_back({e.j, e.i, inverse(T_i_j)});
      }
    }
    std::stable_sort(closures_.begin(), closures_.end(),
                     [](const auto& a, const auto& b) { return a.lower < b.lower; });
  }

  // Pairs of closures of the same robots, not more than kSteps poses apart at both ends together;
  // those with least odometry between come first.
  [[nodiscard]] std::vector<ClosurePair> pairs() const {
    std::vector<ClosurePair> pairs;
    for (std::size_t a = 0; a < closures_.size(); ++a)
      for (std::size_t b = a + 1;
           b < closures_.size() && closures_[b].lower - closures_[a].lower <= kSteps; ++b) {
        const Index steps = closures_[b].lower - closures_[a].lower +
                            std::abs(closures_[b].upper - closures_[a].upper);
        if (steps <= kSteps && same_robots(closures_[a], closures_[b]))
          pairs.push_back({a, b, steps});
      }
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const auto& a, const auto& b) { return a.steps < b.steps; });
    return pairs;
  }

  // Mahalanobis length of the cycle through two closures; nullopt if there is none, or a wide turn.
  [[nodiscard]] std::optional<double> length(std::size_t a, std::size_t b) const {
    const UpwardClosure& one = closures_[a];
    const UpwardClosure& other = closures_[b];
    const auto lower = chain(other.lower, one.lower);
    const auto upper = chain(one.upper, other.upper);
    if (!lower || !upper) return std::nullopt;
    const UncertainPose cycle =
        compose(compose(compose(one.T_lower_upper, *upper), inverse(other.T_lower_upper)), *lower);
    if (angle_of(cycle.T.linear()) > kLargestTurn) return std::nullopt;
    const Vector6 xi = se3_log(cycle.T);
    if (graph_.dimension == 3) return std::sqrt(xi.dot(cycle.Sigma.ldlt().solve(xi)));
    const std::array<int, 3> planar{2, 3, 4};  // angle, x, y
    const Eigen::Vector3d in_plane = xi(planar);
    const Eigen::Matrix3d Sigma = cycle.Sigma(planar, planar);
    return std::sqrt(in_plane.dot(Sigma.ldlt().solve(in_plane)));
  }

 private:
  [[nodiscard]] bool same_robots(const UpwardClosure& a, const UpwardClosure& b) const {
    return graph_.robot_of(a.lower) == graph_.robot_of(b.lower) &&
           graph_.robot_of(a.upper) == graph_.robot_of(b.upper);
  }

  // Along odometry; nullopt where it is interrupted.
  [[nodiscard]] std::optional<UncertainPose> chain(Index from, Index to) const {
    UncertainPose T;
    for (Index i = std::min(from, to); i < std::max(from, to); ++i) {
      const auto& step = step_[static_cast<std::size_t>(i)];
      if (!step) return std::nullopt;
      T = compose(T, *step);
    }
    return from <= to ? T : inverse(T);
  }

  const TeamGraph& graph_;
  std::vector<std::optional<UncertainPose>> step_;  // from each pose to the next
  std::vector<UpwardClosure> closures_;
};

}  // namespace

std::optional<NoiseScale> noise_scale(const TeamGraph& graph, const std::vector<bool>& odometry) {
  const Cycles cycles(graph, odometry);
  Histogram counts(bin_of(kGreatest) + 1, 0.0);
  NoiseScale result;
  for (const ClosurePair& pair : cycles.pairs()) {
    if (result.pairs == kEnoughPairs) break;
    const auto length = cycles.length(pair.a, pair.b);
    if (!length || !std::isfinite(*length)) continue;
    counts[bin_of(*length)] += 1.0;
    ++result.pairs;
  }
  if (result.pairs < kFewPairs) return std::nullopt;
  std::optional<Fit> best;
  for (double scale = kLeastScale; scale <= kGreatestScale; scale *= std::exp(kBin)) {
    const Fit found =
        fit(counts, static_cast<double>(result.pairs), scale, graph.dimension == 2 ? 3 : 6);
    if (best && found.log_likelihood <= best->log_likelihood) continue;
    best = found;
    result.scale = scale;
    result.consistent = found.share;
  }
  return result;
}

}  // namespace km
