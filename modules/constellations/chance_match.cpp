#include "modules/constellations/chance_match.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "modules/objects/object_box.hpp"

namespace km {
namespace {

constexpr double kLog10 = std::numbers::ln10;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The area of b is larger than the box around its centres by this on every side [m].
constexpr double kMargin_m = 1.0;

double log_binomial(int n, int k) {
  return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0);
}

double plane_distance(const Landmark& x, const Landmark& y) {
  return (x.center - y.center).head<2>().norm();
}

// Indices of the two pairs that are farthest apart in b.
std::array<std::size_t, 2> widest(std::span<const LandmarkPair> pairs) {
  std::array<std::size_t, 2> base = {0, 1};
  double most = -1.0;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = i + 1; j < pairs.size(); ++j)
      if (const double d = plane_distance(pairs[i].b, pairs[j].b); d > most) {
        most = d;
        base = {i, j};
      }
  return base;
}

// The motion in the plane that maps the base of b to that of a: middle to middle, and direction to
// direction.
Eigen::Isometry2d base_motion(const LandmarkPair& first, const LandmarkPair& second) {
  const Eigen::Vector2d a = (second.a.center - first.a.center).head<2>();
  const Eigen::Vector2d b = (second.b.center - first.b.center).head<2>();
  Eigen::Isometry2d T_a_b = Eigen::Isometry2d::Identity();
  T_a_b.linear() = Eigen::Rotation2Dd(std::atan2(a.y(), a.x()) - std::atan2(b.y(), b.x())).matrix();
  T_a_b.translation() = 0.5 * (first.a.center + second.a.center).head<2>() -
                        T_a_b.linear() * 0.5 * (first.b.center + second.b.center).head<2>();
  return T_a_b;
}

}  // namespace

ChanceMatch::ChanceMatch(std::span<const Landmark> a, std::span<const Landmark> b) {
  std::vector<Eigen::Vector3d> centers;
  for (const Landmark& landmark : b) centers.push_back(landmark.center);
  const ObjectBox area = centers.empty() ? ObjectBox{} : enclosing_box(centers);
  length_m_ = area.size_m.head<2>().array() + 2.0 * kMargin_m;
  const Eigen::Rotation2Dd to_axes(-area.yaw_rad);
  for (std::size_t i = 0; i < b.size(); ++i)
    for (std::size_t j = i + 1; j < b.size(); ++j) {
      if (b[i].label != b[j].label) continue;
      const Eigen::Vector2d apart = to_axes * (b[i].center - b[j].center).head<2>();
      for (const auto axis : {0U, 1U}) apart_[axis].push_back(std::abs(apart(axis)));
    }
  for (auto& distances : apart_) std::ranges::sort(distances);
  for (const Landmark& landmark : b) {
    const auto known = std::ranges::find(counts_, landmark.label, &LabelCount::label);
    if (known != counts_.end()) {
      ++known->b;
      continue;
    }
    const auto same = std::ranges::count(a, landmark.label, &Landmark::label);
    if (same > 0) counts_.push_back({landmark.label, static_cast<int>(same), 1});
  }
}

// Probability that an unrelated landmark of b lies within t of a place. The share of pairs has one
// pair more in the numerator and two in the denominator (Laplace's rule), so that few pairs never
// state that rows do not exist.
double ChanceMatch::place_probability(double t_m) const {
  double probability = 1.0;
  for (const auto axis : {0U, 1U}) {
    const auto& distances = apart_[axis];
    const auto near = std::ranges::upper_bound(distances, t_m) - distances.begin();
    const double share =
        (static_cast<double>(near) + 1.0) / (static_cast<double>(distances.size()) + 2.0);
    probability *= std::min(1.0, std::max(2.0 * t_m / length_m_(axis), share));
  }
  return probability;
}

// The number of sets of pairs with as many of each label, and of such numbers.
double ChanceMatch::log_choices(std::span<const LandmarkPair> pairs) const {
  double sum = 0.0;
  for (const LabelCount& count : counts_) {
    const int k = static_cast<int>(std::ranges::count_if(
        pairs, [&](const LandmarkPair& pair) { return pair.b.label == count.label; }));
    sum += log_binomial(count.a, k) + log_binomial(count.b, k) + std::lgamma(k + 1.0);
    sum += std::log(std::min(count.a, count.b) + 1.0);
  }
  return sum;
}

double ChanceMatch::log10_expected(std::span<const LandmarkPair> pairs) const {
  if (pairs.size() < 3) return kInfinity;
  const auto [i, j] = widest(pairs);
  const double d = plane_distance(pairs[i].b, pairs[j].b);
  const double base_sigma = std::sqrt(pairs[i].side_variance() + pairs[j].side_variance());
  double rho = std::abs(d - plane_distance(pairs[i].a, pairs[j].a)) / base_sigma;
  const Eigen::Isometry2d T_a_b = base_motion(pairs[i], pairs[j]);
  for (const LandmarkPair& pair : pairs) {
    const double error = (T_a_b * pair.b.center.head<2>() - pair.a.center.head<2>()).norm();
    rho = std::max(rho, error / std::sqrt(pair.side_variance()));
  }
  if (!(rho <= kMaxRho)) return kInfinity;
  rho = std::max(kMinRho, kRhoStep * std::ceil(rho / kRhoStep));
  const double base_t = rho * base_sigma;
  const double ring = 4.0 * std::numbers::pi * d * base_t / length_m_.prod();
  double sum = log_choices(pairs) + std::log(kMaxRho / kRhoStep) +
               std::log(std::min(1.0, std::max(ring, 2.0 * place_probability(base_t))));
  for (std::size_t r = 0; r < pairs.size(); ++r)
    if (r != i && r != j)
      sum += std::log(place_probability(rho * std::sqrt(pairs[r].side_variance())));
  return sum / kLog10;
}

}  // namespace km
