#include "modules/constellations/constellation_match.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include "modules/constellations/constellation_pose.hpp"
#include "modules/outlier_rejection/clique_search.hpp"

namespace km {
namespace {

constexpr double kPi = std::numbers::pi;

// Landmarks of one map that are nearer to each other are perhaps parts of one object, and never
// count as two [m].
constexpr double kApart_m = 1.0;

// Number of windows of yaw. Every yaw is within half a step of the middle of a window.
constexpr int kWindows = 36;
constexpr double kHalfStep_rad = kPi / kWindows;

// An association belongs to the first transform, and not to a second one, within this multiple of
// the gate.
constexpr double kSameTransform = 2.0;

// Share of the pairs of the best set that a second one may have. In a row of n equal objects at
// equal distances, the second set has n - 1 pairs.
constexpr double kMaxSecondPairs = 0.6;

// Smallest set that a search looks for: two pairs always have a transform.
constexpr std::size_t kLeastPairs = 3;

// Sides of one object in two maps differ by no more than this, plus half of the larger one.
constexpr double kSizeMargin_m = 0.3;
constexpr double kSizeShare = 0.5;

// Largest number of associations. Bounds time and memory for maps of equal objects, which have no
// answer: 44 objects of one label in both maps are fewer.
constexpr std::size_t kMaxAssociations = 2000;

struct Association {
  std::size_t a = 0, b = 0;
};

// Two consistent associations, and the yaw that they imply, with its largest error.
struct Consistent {
  std::size_t u = 0, v = 0;
  double yaw_rad = 0.0, yaw_error_rad = 0.0;
};

// Position of a landmark of a map relative to another one.
struct Offset {
  double length_m = 0.0, direction_rad = 0.0, height_m = 0.0;
};

using Offsets = std::vector<std::vector<Offset>>;

void check(std::span<const Landmark> landmarks) {
  for (const Landmark& x : landmarks)
    if (!x.center.allFinite() || !x.size_m.allFinite() || !(x.sigma_m > 0.0) ||
        !std::isfinite(x.side_variance() + x.height_variance()))
      throw std::invalid_argument("match_constellations: a landmark with label " +
                                  std::to_string(x.label) +
                                  " has no finite position or no positive standard deviation");
}

bool are_similar(double x, double y) {
  return std::abs(x - y) <= kSizeMargin_m + kSizeShare * std::max(x, y);
}

// The shorter horizontal side says little: a robot that passes sees one long side.
bool may_be_equal(const Landmark& x, const Landmark& y) {
  return x.label == y.label && are_similar(x.size_m.x(), y.size_m.x()) &&
         are_similar(x.size_m.z(), y.size_m.z());
}

Offsets offsets_of(std::span<const Landmark> landmarks) {
  Offsets offsets(landmarks.size(), std::vector<Offset>(landmarks.size()));
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    for (std::size_t j = 0; j < landmarks.size(); ++j) {
      const Eigen::Vector3d d = landmarks[j].center - landmarks[i].center;
      offsets[i][j] = {d.head<2>().norm(), std::atan2(d.y(), d.x()), d.z()};
    }
  return offsets;
}

double wrapped(double angle_rad) {
  return std::remainder(angle_rad, 2.0 * kPi);
}

/// The associations of two constellations and which of them are consistent.
class ConsistencyGraph {
 public:
  ConsistencyGraph(std::span<const Landmark> a, std::span<const Landmark> b,
                   const ConstellationOptions& options)
      : a_(a), b_(b), options_(options), offsets_a_(offsets_of(a)), offsets_b_(offsets_of(b)) {
    for (std::size_t i = 0; i < a.size(); ++i)
      for (std::size_t p = 0; p < b.size(); ++p)
        if (may_be_equal(a[i], b[p])) associations_.push_back({i, p});
    if (is_too_large()) return;
    for (std::size_t u = 0; u < associations_.size(); ++u)
      for (std::size_t v = u + 1; v < associations_.size(); ++v)
        if (const auto edge = consistent(u, v)) edges_.push_back(*edge);
  }

  [[nodiscard]] bool is_too_large() const { return associations_.size() > kMaxAssociations; }

  // Removes consistency between associations that all fit T_a_b.
  void exclude(const SE3& T_a_b) {
    std::vector<bool> fits;
    for (const Association& pair : associations_) fits.push_back(fits_transform(pair, T_a_b));
    std::erase_if(edges_, [&](const Consistent& edge) { return fits[edge.u] && fits[edge.v]; });
  }

  // The largest clique over all windows with more than `more_than` associations; empty if there is
  // none. Nullopt if a search ended at its limit.
  [[nodiscard]] std::optional<std::vector<Association>> largest(std::size_t more_than) const {
    std::vector<Association> best;
    for (int window = 0; window < kWindows; ++window) {
      const CliqueSearch search = search_window(window, std::max(more_than, best.size()));
      if (!search.proven) return std::nullopt;
      if (search.clique.empty()) continue;
      best.clear();
      for (const std::size_t u : search.clique) best.push_back(associations_[u]);
    }
    return best;
  }

 private:
  [[nodiscard]] double side_variance(std::size_t u) const {
    return a_[associations_[u].a].side_variance() + b_[associations_[u].b].side_variance();
  }
  [[nodiscard]] double height_variance(std::size_t u) const {
    return a_[associations_[u].a].height_variance() + b_[associations_[u].b].height_variance();
  }

  [[nodiscard]] std::optional<Consistent> consistent(std::size_t u, std::size_t v) const {
    const auto [i, p] = associations_[u];
    const auto [j, q] = associations_[v];
    if (i == j || p == q) return std::nullopt;
    const Offset &x = offsets_a_[i][j], &y = offsets_b_[p][q];
    const double shorter = std::min(x.length_m, y.length_m);
    if (shorter < kApart_m) return std::nullopt;
    const double tolerance = options_.gate * std::sqrt(side_variance(u) + side_variance(v));
    if (std::abs(x.length_m - y.length_m) > tolerance) return std::nullopt;
    const double tilt_m = options_.tilt_rad * shorter;
    const double height = height_variance(u) + height_variance(v) + 2.0 * tilt_m * tilt_m;
    if (std::abs(x.height_m - y.height_m) > options_.gate * std::sqrt(height)) return std::nullopt;
    return Consistent{u, v, wrapped(x.direction_rad - y.direction_rad),
                      std::atan2(tolerance, shorter)};
  }

  [[nodiscard]] bool fits_transform(const Association& pair, const SE3& T_a_b) const {
    const Landmark &x = a_[pair.a], &y = b_[pair.b];
    const Eigen::Vector3d error = T_a_b * y.center - x.center;
    const double limit = kSameTransform * options_.gate;
    return error.head<2>().norm() <= limit * std::sqrt(x.side_variance() + y.side_variance());
  }

  [[nodiscard]] CliqueSearch search_window(int window, std::size_t more_than) const {
    const double middle = 2.0 * kHalfStep_rad * window;
    BitGraph graph(associations_.size());
    for (const Consistent& edge : edges_)
      if (std::abs(wrapped(edge.yaw_rad - middle)) <= kHalfStep_rad + edge.yaw_error_rad)
        graph.connect(edge.u, edge.v);
    std::vector<std::size_t> candidates;
    for (std::size_t u = 0; u < graph.size(); ++u)
      if (graph.degree(u) >= more_than) candidates.push_back(u);
    return find_clique(graph, candidates,
                       {.more_than = more_than,
                        .enough = candidates.size(),
                        .max_nodes = options_.max_search_nodes});
  }

  std::span<const Landmark> a_, b_;
  const ConstellationOptions& options_;
  const Offsets offsets_a_, offsets_b_;
  std::vector<Association> associations_;
  std::vector<Consistent> edges_;
};

std::vector<LandmarkPair> pairs_of(std::span<const Landmark> a, std::span<const Landmark> b,
                                   const std::vector<Association>& set) {
  std::vector<LandmarkPair> pairs;
  for (const Association& pair : set) pairs.push_back({a[pair.a], b[pair.b]});
  return pairs;
}

}  // namespace

const char* to_string(ConstellationStatus status) {
  constexpr std::array kNames = {"matched", "too few", "ambiguous",
                                 "undecided"};  // in the order of ConstellationStatus
  return kNames.at(static_cast<std::size_t>(status));
}

std::size_t min_pairs(const ConstellationOptions& options) {
  return options.margin + kLeastPairs - 1;
}

ConstellationMatch match_constellations(std::span<const Landmark> a, std::span<const Landmark> b,
                                        const ConstellationOptions& options) {
  check(a);
  check(b);
  ConstellationMatch match;
  ConsistencyGraph graph(a, b, options);
  const auto first = graph.is_too_large() ? std::nullopt : graph.largest(kLeastPairs - 1);
  if (!first) return {.status = ConstellationStatus::kUndecided};
  for (const Association& pair : *first) match.pairs.push_back({pair.a, pair.b});
  std::ranges::sort(match.pairs);
  if (first->size() < min_pairs(options)) return match;

  match.T_a_b = constellation_pose(pairs_of(a, b, *first), options.tilt_rad);
  graph.exclude(match.T_a_b.T);
  const auto second = graph.largest(kLeastPairs - 1);
  match.status = ConstellationStatus::kUndecided;
  if (!second) return match;
  match.second_pairs = second->size();
  const auto pairs = static_cast<double>(first->size());
  const bool is_clear = first->size() >= match.second_pairs + options.margin &&
                        static_cast<double>(match.second_pairs) <= kMaxSecondPairs * pairs;
  match.status = is_clear ? ConstellationStatus::kMatched : ConstellationStatus::kAmbiguous;
  return match;
}

}  // namespace km
