#include "modules/robust/odometry_evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "modules/core/geometry/lie.hpp"
#include "modules/robust/closure_places.hpp"
#include "modules/robust/corroboration.hpp"
#include "modules/robust/cycle_mixture.hpp"
#include "modules/robust/odometry_cycles.hpp"
#include "modules/robust/tree_messages.hpp"

namespace km {
namespace {

constexpr std::size_t kNearestPlaces = 3;  // cycles of a place with other places
constexpr std::size_t kPlacesBeside = 8;   // places before and after, among which the nearest are
constexpr std::size_t kMostPlaces = 60;    // bounds the time
constexpr std::size_t kEnoughPlaces = 3;
constexpr double kMostPlacesTrue = kMostlyTrue * kMostlyTrue;  // share of cycles of two places

double log_prior(double level) {
  const double away = level * std::numbers::ln2 / kNoiseFactorWidth;
  return -std::log1p(away * away);
}

// The odometry of one robot between ends of closures. Covariances are in the frame of the first
// pose, accumulated from there.
class PublicChain {
 public:
  PublicChain(std::set<KeyframeId> ends, const std::function<SE3(const KeyframeId&)>& pose,
              const Matrix6& step) {
    Matrix6 Sigma = Matrix6::Zero();
    const SE3 T_first = pose(*ends.begin()).inverse();
    KeyframeId before = *ends.begin();
    for (const KeyframeId& id : ends) {
      const SE3 T = T_first * pose(id);
      const double steps = steps_between(before, id);
      Matrix6 added = steps * step;
      // Noise of rotation along the steps moves the end: its mean lever arm is half of the way.
      if (steps > 0.0) {
        const double way2 = (T.translation() - at_.at(before).T.translation()).squaredNorm();
        added.diagonal().tail<3>().array() += added(2, 2) * way2 / 3.0;
      }
      const Matrix6 Ad = adjoint(T);
      Sigma += Ad * added * Ad.transpose();
      at_[id] = {T, Sigma};
      before = id;
    }
  }

  [[nodiscard]] UncertainPose between(const KeyframeId& from, const KeyframeId& to) const {
    if (to < from) return inverse(between(to, from));
    const UncertainPose &a = at_.at(from), &b = at_.at(to);
    const Matrix6 Ad = adjoint(b.T.inverse());
    return {a.T.inverse() * b.T, Ad * (b.Sigma - a.Sigma) * Ad.transpose()};
  }

 private:
  std::map<KeyframeId, UncertainPose> at_;
};

struct PlaceClosure {
  KeyframeId lower;  // on the first robot
  KeyframeId upper;
  UncertainPose T;  // from the lower to the upper end
};

struct PairCycle {
  Vector6 error;
  std::array<Matrix6, 3> Sigma;  // odometry of the first robot, of the other one, closures
  double log_if_false = 0.0;
};

// The first closure of each place.
std::vector<PlaceClosure> representatives(std::span<const PoseEdge> closures, int dimension) {
  std::vector<PlaceClosure> all, kept;
  const ClosureGroups places = find_places(closures);
  std::vector<bool> seen(places.sizes.size(), false);
  for (const auto& [id, k] : order_of(closures)) {
    if (seen[places.group_of[k]]) continue;
    seen[places.group_of[k]] = true;
    const PoseEdge& e = closures[k];
    const UncertainPose measured{e.T_from_to, covariance_in(e.precision, dimension)};
    all.push_back({id.from, id.to, e.from == id.from ? measured : inverse(measured)});
  }
  const std::size_t stride = (all.size() + kMostPlaces - 1) / kMostPlaces;
  for (std::size_t k = 0; k < all.size(); k += stride) kept.push_back(all[k]);
  return kept;
}

// Every place with its nearest ones, by the steps of odometry between them.
std::set<std::pair<std::size_t, std::size_t>> near_places(const std::vector<PlaceClosure>& places) {
  std::vector<std::size_t> order(places.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::vector<std::set<std::pair<KeyframeIndex, std::size_t>>> near(places.size());
  for (const auto end : {&PlaceClosure::lower, &PlaceClosure::upper}) {
    std::ranges::sort(order, {}, [&](std::size_t k) { return std::pair(places[k].*end, k); });
    for (std::size_t i = 0; i < order.size(); ++i)
      for (std::size_t j = i + 1; j < std::min(order.size(), i + 1 + kPlacesBeside); ++j) {
        const PlaceClosure &one = places[order[i]], &other = places[order[j]];
        const KeyframeIndex steps =
            steps_between(one.lower, other.lower) + steps_between(one.upper, other.upper);
        near[order[i]].insert({steps, order[j]});
        near[order[j]].insert({steps, order[i]});
      }
  }
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t k = 0; k < near.size(); ++k) {
    std::size_t taken = 0;
    for (const auto& [steps, other] : near[k]) {
      if (steps == 0) continue;
      if (taken++ == kNearestPlaces) break;
      pairs.insert(std::minmax(k, other));
    }
  }
  return pairs;
}

double log_ratio_with(const PairCycle& cycle, double noise_a, double noise_b, double noise_c,
                      int dimension) {
  const Matrix6 Sigma = noise_a * noise_a * cycle.Sigma[0] + noise_b * noise_b * cycle.Sigma[1] +
                        noise_c * noise_c * cycle.Sigma[2];
  return log_density_if_true(cycle.error, Sigma, dimension) - cycle.log_if_false;
}

std::vector<PairCycle> pair_cycles(const std::vector<PlaceClosure>& places,
                                   const std::function<SE3(const KeyframeId&)>& pose,
                                   const std::map<RobotId, Precision>& step, int dimension) {
  std::set<KeyframeId> lower, upper;
  for (const PlaceClosure& c : places) {
    lower.insert(c.lower);
    upper.insert(c.upper);
  }
  const auto noise = [&](const std::set<KeyframeId>& ends) {
    return covariance_in(step.at(ends.begin()->robot), dimension);
  };
  const PublicChain below(lower, pose, noise(lower)), above(upper, pose, noise(upper));
  ClosureVolume volume;
  for (const PlaceClosure& c : places) {
    volume.add_ends(pose(c.lower).translation(), pose(c.upper).translation());
    volume.add_length(c.T.T.translation().norm());
  }
  std::vector<PairCycle> cycles;
  for (const auto& [k, l] : near_places(places)) {
    const PlaceClosure &one = places[k], &other = places[l];
    const TwoClosureCycle around{one.T, above.between(one.upper, other.upper), inverse(other.T),
                                 below.between(other.lower, one.lower)};
    const TwoClosureCycle along_a{exact(around.up), exact(around.above), exact(around.down),
                                  around.below};
    const TwoClosureCycle along_b{exact(around.up), around.above, exact(around.down),
                                  exact(around.below)};
    const Vector6 error = se3_log(around.T());
    cycles.push_back({error,
                      {along_a.covariance(), along_b.covariance(), around.covariance_of_closures()},
                      log_density_if_false(error, volume.of(dimension), dimension)});
  }
  return cycles;
}

using Levels = std::map<RobotId, std::size_t>;

double evidence_at(const PairVote& v, const Levels& levels) {
  return static_cast<double>(v.odometry[kNoiseLevels * levels.at(v.a) + levels.at(v.b)]);
}

double log_posterior_of(std::span<const PairVote> votes, const Levels& levels) {
  double sum = 0.0;
  for (const PairVote& v : votes) sum += evidence_at(v, levels);
  for (const auto& [robot, level] : levels) sum += log_prior(static_cast<double>(level));
  return sum;
}

Levels with(Levels levels, RobotId robot, std::size_t level) {
  levels[robot] = level;
  return levels;
}

// Improves the levels, the level first that gains most. Those in `honest` have level 0.
Levels best_levels(std::span<const PairVote> votes, const std::set<RobotId>& honest,
                   Levels levels) {
  for (const RobotId robot : honest) levels[robot] = 0;
  double most = log_posterior_of(votes, levels);
  for (bool better = true; std::exchange(better, false);)
    for (const Levels before = levels; const auto& [robot, any] : before)
      for (std::size_t level = 0; level < kNoiseLevels && !honest.contains(robot); ++level) {
        const Levels next = with(before, robot, level);
        const double found = log_posterior_of(votes, next);
        if (!(found > most)) continue;
        most = found;
        levels = next;
        better = true;
      }
  return levels;
}

// True if a robot has evidence in several pairs, and all but the strongest one of them refute its
// noise: one wrong peer must not weaken it. Pairs may differ by one level.
bool rests_on_one_pair(std::span<const PairVote> votes, const Levels& levels, RobotId robot) {
  const auto others_allow = [&](std::size_t level) {
    std::vector<double> gains;
    for (const PairVote& v : votes)
      if (v.a == robot || v.b == robot)
        gains.push_back(evidence_at(v, with(levels, robot, level)) -
                        evidence_at(v, with(levels, robot, 0)));
    std::ranges::sort(gains);
    return gains.size() < 2 || std::reduce(gains.begin(), gains.end() - 1) > -kTenToOne;
  };
  const std::size_t level = levels.at(robot);
  return !others_allow(level) && !(level > 1 && others_allow(level - 1));
}

// The robot whose noise is the least likely one beside the noise of the others, if the odds are
// below 10 to 1. If the odds only leave open which one of two robots is noisy, both are likely.
std::optional<RobotId> least_likely(std::span<const PairVote> votes, const Levels& levels) {
  double least = kTenToOne;
  std::optional<RobotId> doubtful;
  const double most = log_posterior_of(votes, levels);
  for (const auto& [robot, level] : levels) {
    if (level == 0) continue;
    if (rests_on_one_pair(votes, levels, robot)) return robot;
    const double odds = most - log_posterior_of(votes, with(levels, robot, 0));
    if (!(odds < least)) continue;
    least = odds;
    doubtful = robot;
  }
  return doubtful;
}

// The factor at the top of the parabola through the best level of a robot and those beside it.
double refined_noise(std::span<const PairVote> votes, const Levels& levels, RobotId robot) {
  const std::size_t level = levels.at(robot);
  double offset = 0.0;
  if (level + 1 < kNoiseLevels) {
    const double here = log_posterior_of(votes, levels);
    const double below = log_posterior_of(votes, with(levels, robot, level - 1));
    const double above = log_posterior_of(votes, with(levels, robot, level + 1));
    const double bend = below - 2.0 * here + above;
    if (bend < 0.0) offset = 0.5 * (below - above) / bend;
  }
  return std::exp2(static_cast<double>(level) + offset);
}

// The same cycles, if false ones end near each other: see log_densities_if_near().
std::optional<std::vector<PairCycle>> if_near(std::vector<PairCycle> cycles, int dimension) {
  std::vector<Vector6> errors;
  std::vector<double> uniform;
  for (const PairCycle& cycle : cycles) {
    errors.push_back(cycle.error);
    uniform.push_back(cycle.log_if_false);
  }
  const auto log_if_true = [&](std::size_t k, double noise) {
    return log_ratio_with(cycles[k], 1.0, 1.0, noise, dimension) + uniform[k];
  };
  const auto normal = log_densities_if_near(errors, uniform, log_if_true, dimension);
  if (!normal) return std::nullopt;
  for (std::size_t k = 0; k < cycles.size(); ++k) cycles[k].log_if_false = (*normal)[k];
  return cycles;
}

struct Evidence {
  std::vector<float> by_level = {};  // see odometry_evidence()
  bool mostly_true = false;
};

Evidence evidence_of(const std::vector<PairCycle>& cycles, const std::vector<double>& weights,
                     bool a_is_first, int dimension) {
  Evidence evidence;
  double most = -std::numeric_limits<double>::infinity();
  constexpr int kLevels = kNoiseLevels;
  for (int i = 0; i < kLevels; ++i)
    for (int j = 0; j < kLevels; ++j) {
      double best = -std::numeric_limits<double>::infinity();
      for (const double noise : kNoiseOfClosures) {
        std::vector<double> ratios;
        for (const PairCycle& cycle : cycles)
          ratios.push_back(log_ratio_with(cycle, std::ldexp(1.0, a_is_first ? i : j),
                                          std::ldexp(1.0, a_is_first ? j : i), noise, dimension));
        const CycleMixture mixture = fit_cycle_mixture(ratios, weights);
        const double found = mixture.log_likelihood + log_prior(std::log2(noise));
        best = std::max(best, found);
        if (!(found > most)) continue;
        most = found;
        evidence.mostly_true = mixture.share > kMostPlacesTrue;
      }
      if (!std::isfinite(best)) return {};
      evidence.by_level.push_back(static_cast<float>(best));
    }
  return evidence;
}

}  // namespace

std::vector<float> odometry_evidence(std::span<const PoseEdge> closures,
                                     const std::function<SE3(const KeyframeId&)>& pose,
                                     const std::map<RobotId, Precision>& step, int dimension) {
  const std::vector<PlaceClosure> places = representatives(closures, dimension);
  if (places.size() < kEnoughPlaces) return {};
  const std::vector<PairCycle> cycles = pair_cycles(places, pose, step, dimension);
  if (cycles.empty()) return {};
  const double weight =
      std::min(1.0, static_cast<double>(places.size() - 1) / static_cast<double>(cycles.size()));
  const std::vector<double> weights(cycles.size(), weight);
  const bool a_is_first = places.front().lower.robot < places.front().upper.robot;
  const std::optional<std::vector<PairCycle>> near = if_near(cycles, dimension);
  auto [evidence, mostly_true] = evidence_of(cycles, weights, a_is_first, dimension);
  if (near) mostly_true &= evidence_of(*near, weights, a_is_first, dimension).mostly_true;
  if (!mostly_true && !evidence.empty())
    for (float& e : evidence) e = std::min(e, evidence.front());
  return evidence;
}

std::map<RobotId, double> likely_odometry_noise(std::span<const PairVote> pairs) {
  std::vector<PairVote> votes;
  Levels levels;
  for (const PairVote& v : pairs) {
    if (v.odometry.empty()) continue;
    votes.push_back(v);
    levels[v.a] = levels[v.b] = 0;
  }
  std::set<RobotId> honest;
  levels = best_levels(votes, honest, levels);
  while (const auto doubtful = least_likely(votes, levels)) {
    honest.insert(*doubtful);
    levels = best_levels(votes, honest, levels);
  }
  std::map<RobotId, double> factors;
  for (const auto& [robot, level] : levels)
    if (level > 0) factors[robot] = refined_noise(votes, levels, robot);
  if (2 * factors.size() > levels.size()) factors.clear();
  return factors;
}

}  // namespace km
