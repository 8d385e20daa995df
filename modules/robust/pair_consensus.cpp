#include "modules/robust/pair_consensus.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <vector>

#include "modules/core/lie.hpp"
#include "modules/robust/closure_places.hpp"
#include "modules/robust/frame_alignment.hpp"

namespace km {
namespace {

constexpr std::size_t kEnoughCandidates = 200;
// Lower limit of the spread of a pair [m].
constexpr double kLeastSpread_m = 1e-3;
// Misfit from which on a pair does not fit [spreads].
constexpr double kMisfit_spreads = 4.0;
// Least gain in the number of fitting pairs for which robots are moved.
constexpr double kLeastGain = 0.5;
// Least support of a confirmed pair: the loop through a third robot closes within twice the sum of
// the spreads of its three pairs.
constexpr double kConfirming = 0.2;
// Largest spread of consistent closures of a pair, relative to the radius.
constexpr double kLargestSpreadRatio = 0.25;
// Number of places of a pair that agree on its motion, from which on only those places count.
constexpr std::size_t kAgreeingPlaces = 3;

// The pairs with a vote.
PairMotions agreeing(PairMotions pairs) {
  std::erase_if(pairs, [](const auto& entry) {
    return entry.second.spread_m > kLargestSpreadRatio * entry.second.radius_m;
  });
  return pairs;
}

std::set<RobotId> robots_of(const PairMotions& pairs) {
  std::set<RobotId> robots;
  for (const auto& [pair, motion] : pairs) robots.insert({pair.first, pair.second});
  return robots;
}

const PairMotion* find(const PairMotions& pairs, RobotId a, RobotId b) {
  const auto found = pairs.find(std::minmax(a, b));
  return found == pairs.end() ? nullptr : &found->second;
}

// The motion (see PairMotion) of robot b that fits the closures of a and b if a does not move.
SE3 motion_between(const PairMotions& pairs, RobotId a, RobotId b) {
  const SE3 T = pairs.at(std::minmax(a, b)).T.pose();
  return a < b ? T : T.inverse();
}

double length_m(const SE3& T, const PairMotion& pair) {
  return (T * pair.centre - pair.centre).norm() + pair.radius_m * angle_of(T.linear());
}

double spread_m(const PairMotion& pair) {
  return std::max(kLeastSpread_m, pair.spread_m);
}

// Support of a pair, in [0, number of robots]: the number of third robots through which the loop
// closes.
double support(const PairMotions& pairs, const std::set<RobotId>& robots, RobotId a, RobotId b) {
  const PairMotion& pair = pairs.at({a, b});
  double sum = 0.0;
  for (const RobotId k : robots) {
    if (k == a || k == b) continue;
    const PairMotion* ak = find(pairs, a, k);
    const PairMotion* bk = find(pairs, b, k);
    if (ak == nullptr || bk == nullptr) continue;
    const SE3 round =
        motion_between(pairs, a, k) * motion_between(pairs, k, b) * pair.T.pose().inverse();
    const double ratio = length_m(round, pair) / (spread_m(pair) + spread_m(*ak) + spread_m(*bk));
    sum += 1.0 / (1.0 + ratio * ratio);
  }
  return sum;
}

std::map<RobotId, SE3> placed_by_tree(const PairMotions& pairs, const std::set<RobotId>& robots) {
  std::vector<std::tuple<double, RobotId, RobotId>> order;
  for (const auto& [pair, motion] : pairs)
    order.emplace_back(-support(pairs, robots, pair.first, pair.second), pair.first, pair.second);
  std::sort(order.begin(), order.end());
  std::map<RobotId, SE3> placed{{*robots.begin(), SE3::Identity()}};
  for (bool grown = true; grown;) {  // Prim: the best pair that reaches another robot
    grown = false;
    for (const auto& [less, a, b] : order) {
      if (placed.contains(a) == placed.contains(b)) continue;
      const auto [from, to] = placed.contains(a) ? std::pair(a, b) : std::pair(b, a);
      placed[to] = placed.at(from) * motion_between(pairs, from, to);
      grown = true;
      break;
    }
  }
  return placed;
}

// Sum of the misfits of all pairs after the motions `placed`, each limited to 1.
double misfit(const PairMotions& pairs, const std::map<RobotId, SE3>& placed) {
  double sum = 0.0;
  for (const auto& [robots, pair] : pairs) {
    const SE3 left = placed.at(robots.second).inverse() * placed.at(robots.first) * pair.T.pose();
    const double ratio = length_m(left, pair) / (kMisfit_spreads * spread_m(pair));
    sum += std::min(1.0, ratio * ratio);
  }
  return sum;
}

// Shifts all motions together so that as many robots as possible do not move.
void keep_most_still(const PairMotions& pairs, std::map<RobotId, SE3>& placed) {
  const auto staying = [&](const SE3& T) {
    std::set<RobotId> moving;
    for (const auto& [robots, pair] : pairs)
      for (const RobotId robot : {robots.first, robots.second})
        if (length_m(T * placed.at(robot), pair) > kMisfit_spreads * spread_m(pair))
          moving.insert(robot);
    return placed.size() - moving.size();
  };
  SE3 best = SE3::Identity();
  std::size_t most = 0;
  for (const auto& [robot, T] : placed)
    if (const std::size_t stay = staying(T.inverse()); stay > most) {
      most = stay;
      best = T.inverse();
    }
  for (auto& [robot, T] : placed) T = best * T;
}

// Largest weights, relative to a step of the lower median robot. A closure may have half the sigma
// of that step. The errors of odometry add up, so the limit on the mean step of a robot is
// stricter.
constexpr double kMostPrecise = 4.0;
constexpr double kBestOdometry = 1.25;
constexpr std::size_t kMajority = 3;

}  // namespace

std::optional<PairMotion> motion_of_pair(std::span<const PoseEdge> closures, RobotId a,
                                         const std::function<SE3(const KeyframeId&)>& pose) {
  if (closures.empty()) return std::nullopt;
  const ClosurePlaces found = find_places(closures);
  const std::vector<double> weight_of = found.weights();
  const std::size_t stride = (closures.size() + kEnoughCandidates - 1) / kEnoughCandidates;
  PairMotion result;
  std::vector<std::pair<SE3, SE3>> ends;  // ends on b: present pose, pose by the closure
  std::vector<double> weights;
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < closures.size(); k += stride) {
    const PoseEdge& e = closures[k];
    weights.push_back(weight_of[k]);
    places.push_back(found.place_of[k]);
    const SE3 T_a_b = e.from.robot == a ? e.T_from_to : e.T_from_to.inverse();
    ends.emplace_back(pose(e.other(a)), pose(e.end_on(a)) * T_a_b);
    result.centre += ends.back().first.translation();
  }
  result.centre /= static_cast<double>(ends.size());
  const SE3 to_centre = make_pose(Eigen::Matrix3d::Identity(), result.centre);
  std::vector<SE3> candidates;
  for (const auto& [placed, measured] : ends) {
    candidates.push_back(measured * placed.inverse() * to_centre);
    result.radius_m += (placed.translation() - result.centre).squaredNorm();
  }
  result.radius_m = std::sqrt(result.radius_m / static_cast<double>(ends.size()));
  const auto alignment = align_frames(candidates, weights);
  const SE3 T = alignment->T * to_centre.inverse();
  result.T = SinglePose::of(T);
  for (const PoseEdge& e : closures) {
    result.strength.kappa += e.precision.kappa;
    result.strength.tau += e.precision.tau;
  }
  // Several places do not agree by chance, however many other places disagree.
  std::set<std::size_t> agreeing_places;
  for (const std::size_t k : alignment->inliers) agreeing_places.insert(places[k]);
  const bool by_places = agreeing_places.size() >= kAgreeingPlaces;
  std::vector<double> distances;
  for (std::size_t k = 0; k < ends.size(); ++k) {
    const auto& [placed, measured] = ends[k];
    if (!by_places || std::ranges::binary_search(alignment->inliers, k))
      distances.push_back((T * placed.translation() - measured.translation()).norm());
  }
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  result.spread_m = *middle;
  return result;
}

std::map<RobotId, SE3> better_placement(const PairMotions& all) {
  const PairMotions pairs = agreeing(all);
  const std::set<RobotId> robots = robots_of(pairs);
  if (robots.empty()) return {};
  std::map<RobotId, SE3> still;
  for (const RobotId robot : robots) still[robot] = SE3::Identity();
  std::map<RobotId, SE3> placed = placed_by_tree(pairs, robots);
  if (placed.size() < robots.size() || misfit(pairs, placed) > misfit(pairs, still) - kLeastGain)
    return {};
  keep_most_still(pairs, placed);
  return placed;
}

Precision lower_median(std::span<const Precision> values) {
  const auto of = [&](double Precision::*weight) {
    std::vector<double> weights;
    for (const Precision& value : values) weights.push_back(value.*weight);
    const auto middle = weights.begin() + (static_cast<std::ptrdiff_t>(weights.size()) - 1) / 2;
    std::nth_element(weights.begin(), middle, weights.end());
    return *middle;
  };
  return {of(&Precision::kappa), of(&Precision::tau)};
}

Precision usual_strength(const PairMotions& all) {
  const PairMotions pairs = agreeing(all);
  const std::set<RobotId> robots = robots_of(pairs);
  if (robots.size() < kEnoughToOutvote) return kUnlimited;
  std::map<RobotId, std::vector<Precision>> of_robot;
  for (const auto& [ends, pair] : pairs) {
    if (support(pairs, robots, ends.first, ends.second) < kConfirming) continue;
    for (const RobotId robot : {ends.first, ends.second}) of_robot[robot].push_back(pair.strength);
  }
  if (of_robot.empty()) return kUnlimited;
  std::vector<Precision> medians;
  for (const auto& [robot, strengths] : of_robot) medians.push_back(lower_median(strengths));
  return lower_median(medians);
}

void limit_precisions(SessionGraph& graph) {
  if (graph.step_precision.size() < kMajority) return;
  const Precision own = graph.step_precision[graph.self];
  std::vector<Precision> steps;
  for (const auto& [robot, step] : graph.step_precision) steps.push_back(step);
  const Precision usual = lower_median(steps);
  const auto limited = [&](const Precision& p) {
    return Precision{std::min(p.kappa, kMostPrecise * usual.kappa),
                     std::min(p.tau, kMostPrecise * usual.tau)};
  };
  for (auto* edges : {&graph.own, &graph.fixes})
    for (PoseEdge& e : *edges) {
      e.precision.kappa *= std::min(1.0, kBestOdometry * usual.kappa / own.kappa);
      e.precision.tau *= std::min(1.0, kBestOdometry * usual.tau / own.tau);
    }
  for (auto* edges : {&graph.between, &graph.to_absent})
    for (PoseEdge& e : *edges) e.precision = limited(e.precision);
  for (auto& [robot, step] : graph.step_precision) step = limited(step);
}

}  // namespace km
