#include "modules/robust/pair_consensus.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include "modules/core/geometry/lie.hpp"
#include "modules/robust/closure_places.hpp"
#include "modules/robust/frame_alignment.hpp"

namespace km {
namespace {

constexpr std::size_t kEnoughCandidates = 200;
// Lower limit of the spread of a pair [m].
constexpr double kLeastSpread_m = 1e-3;
// Least support of a confirmed pair: the loop through a third robot closes within twice the sum of
// the spreads of its three pairs.
constexpr double kConfirming = 0.2;
// Largest spread of consistent closures of a pair, relative to the radius and to the mean standard
// deviation of a closure. The distance of one true closure exceeds the second one in 3 of 100.
constexpr double kLargestSpreadRatio = 0.25;
constexpr double kLargestSpreadSigmas = 3.0;
// Difference of the votes of two motions from which on votes decide: two places.
constexpr double kCertainVotes = 2.0 * kVotesOfPlace;
// Ratio of the errors of two loops below which the first motion is right.
constexpr double kClearly = 0.25;
constexpr double kVotesOfDatum = 1e9;  // more than all closures have
// Number of rows of a pair that agree on its motion, from which on only those rows count.
constexpr std::size_t kAgreeingRows = 3;

bool has_vote(const PairMotion& pair) {
  return pair.spread_m <= pair.consistent_m;
}

// The pairs with a vote.
PairMotions agreeing(PairMotions pairs) {
  std::erase_if(pairs, [](const auto& entry) { return !has_vote(entry.second); });
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

// Mean and variance of positions.
struct Extent {
  double count = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squares = 0.0;

  void add(const Eigen::Vector3d& p) {
    count += 1.0;
    sum += p;
    squares += p.squaredNorm();
  }
  [[nodiscard]] Eigen::Vector3d mean() const { return sum / count; }
  [[nodiscard]] double variance() const {
    return std::max(0.0, squares / count - mean().squaredNorm());
  }
};

double length_m(const SE3& T, const PairMotion& pair) {
  return (T * pair.centre - pair.centre).norm() + pair.radius_m * angle_of(T.linear());
}

double spread_m(const PairMotion& pair) {
  return std::max(kLeastSpread_m, pair.spread_m);
}

// Errors of the loops of a pair through third robots [sums of the three spreads].
std::map<RobotId, double> loop_errors(const PairMotions& pairs, const std::set<RobotId>& robots,
                                      const std::pair<RobotId, RobotId>& ends,
                                      const PairMotion& pair) {
  std::map<RobotId, double> errors;
  for (const RobotId k : robots) {
    if (k == ends.first || k == ends.second) continue;
    const PairMotion* ak = find(pairs, ends.first, k);
    const PairMotion* bk = find(pairs, ends.second, k);
    if (ak == nullptr || bk == nullptr) continue;
    const SE3 round = motion_between(pairs, ends.first, k) * motion_between(pairs, k, ends.second) *
                      pair.T.pose().inverse();
    errors[k] = length_m(round, pair) / (spread_m(pair) + spread_m(*ak) + spread_m(*bk));
  }
  return errors;
}

// Support of a pair, in [0, number of robots]: the number of third robots through which the loop
// closes.
double support(const PairMotions& pairs, const std::set<RobotId>& robots,
               const std::pair<RobotId, RobotId>& ends) {
  double sum = 0.0;
  for (const auto& [third, error] : loop_errors(pairs, robots, ends, pairs.at(ends)))
    sum += 1.0 / (1.0 + error * error);
  return sum;
}

// The pair with its rival as its motion.
PairMotion exchanged(PairMotion pair) {
  std::swap(pair.T, pair.rival);
  std::swap(pair.centre, pair.rival_centre);
  std::swap(pair.votes, pair.rival_votes);
  return pair;
}

// If the two motions of a pair have nearly equal votes, third robots decide. Odometry between rows
// drifts, so that loops need not close. A loop decides if its errors differ clearly.
PairMotions with_confirmed_motions(const PairMotions& given, const std::set<RobotId>& robots) {
  const PairMotions voting = agreeing(given);
  PairMotions decided = given;
  for (auto& [ends, pair] : decided) {
    if (pair.rival_votes == 0.0 || pair.votes - pair.rival_votes >= kCertainVotes) continue;
    const auto by_pair = loop_errors(voting, robots, ends, pair);
    int for_rival = 0;
    for (const auto& [third, error] : loop_errors(voting, robots, ends, exchanged(pair))) {
      for_rival += error < kClearly * by_pair.at(third) ? 1 : 0;
      for_rival -= by_pair.at(third) < kClearly * error ? 1 : 0;
    }
    if (for_rival > 0) pair = exchanged(pair);
  }
  return decided;
}

// Largest weights, relative to a step of the lower median robot. A closure may have half the sigma
// of that step. The errors of odometry add up, so the limit on the mean step of a robot is
// stricter.
constexpr double kMostPrecise = 4.0;
constexpr double kBestOdometry = 1.25;
constexpr std::size_t kMajority = 3;

// The medians of kappa and of tau are independent. Precondition: `values` is not empty.
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

}  // namespace

std::optional<PairMotion> motion_of_pair(std::span<const PoseEdge> closures, RobotId a,
                                         const std::function<SE3(const KeyframeId&)>& pose) {
  if (closures.empty()) return std::nullopt;
  const RobotId first = first_robot(closures);
  const std::vector<std::size_t> row_of = find_rows(closures).group_of;
  const std::vector<double> votes_of = find_places(closures).votes();
  const std::size_t stride = (closures.size() + kEnoughCandidates - 1) / kEnoughCandidates;
  std::vector<SE3> placed, measured;  // ends on the second robot: present poses, by the closures
  std::vector<double> votes;
  std::vector<std::size_t> rows;
  Extent on_first, on_second;
  const ClosureOrder order = order_of(closures);
  for (std::size_t i = 0; i < order.size(); i += stride) {
    const std::size_t k = order[i].second;
    const PoseEdge& e = closures[k];
    votes.push_back(votes_of[k]);
    rows.push_back(row_of[k]);
    const SE3 T_first_second = e.from.robot == first ? e.T_from_to : e.T_from_to.inverse();
    const SE3 T_first = pose(e.end_on(first));
    placed.push_back(pose(e.other(first)));
    measured.push_back(T_first * T_first_second);
    on_first.add(T_first.translation());
    on_second.add(placed.back().translation());
  }
  const SE3 to_centre = make_pose(Eigen::Matrix3d::Identity(), on_second.mean());
  std::vector<SE3> candidates;
  for (std::size_t k = 0; k < placed.size(); ++k)
    candidates.push_back(measured[k] * placed[k].inverse() * to_centre);
  const auto alignment = align_frames(candidates, votes);
  const SE3 T = alignment->T * to_centre.inverse();
  const auto of_b = [&](const SE3& motion) {
    return SinglePose::of(a == first ? motion : motion.inverse());
  };
  const auto centre_after = [&](const FrameAlignment& aligned) -> Eigen::Vector3d {
    return a == first ? aligned.T.translation() : on_second.mean();
  };
  PairMotion result{.T = of_b(T), .centre = centre_after(*alignment)};
  std::vector<std::size_t> others;  // closures that do not agree on T
  std::vector<SE3> other_candidates;
  std::vector<double> other_votes;
  for (std::size_t k = 0; k < placed.size(); ++k)
    if (!std::ranges::binary_search(alignment->inliers, k)) {
      others.push_back(k);
      other_candidates.push_back(candidates[k]);
      other_votes.push_back(votes[k]);
    }
  std::set<std::size_t> of_rival;
  if (const auto rival = align_frames(other_candidates, other_votes)) {
    result.rival = of_b(rival->T * to_centre.inverse());
    result.rival_centre = centre_after(*rival);
    for (const std::size_t k : rival->inliers) {
      of_rival.insert(others[k]);
      result.rival_votes += other_votes[k];
    }
  }
  result.radius_m = std::sqrt(0.5 * (on_first.variance() + on_second.variance()));
  for (const PoseEdge& e : closures) {
    result.strength.kappa += e.precision.kappa;
    result.strength.tau += e.precision.tau;
  }
  // Several rows do not agree by chance, however many other rows disagree.
  std::set<std::size_t> agreeing_rows;
  for (const std::size_t k : alignment->inliers) {
    agreeing_rows.insert(rows[k]);
    result.votes += votes[k];
  }
  const bool by_rows = agreeing_rows.size() >= kAgreeingRows;
  std::vector<double> distances;
  for (std::size_t k = 0; k < placed.size(); ++k)
    if (std::ranges::binary_search(alignment->inliers, k) || !(by_rows || of_rival.contains(k)))
      distances.push_back((T * placed[k].translation() - measured[k].translation()).norm());
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  result.spread_m = *middle;
  result.consistent_m = std::max(
      kLargestSpreadRatio * result.radius_m,
      kLargestSpreadSigmas * std::sqrt(static_cast<double>(closures.size()) / result.strength.tau));
  return result;
}

PairMotion tied(const PairMotion& by_closures, const PoseEdge& tie,
                const std::function<SE3(const KeyframeId&)>& pose) {
  PairMotion motion = *motion_of_pair(std::array{tie}, tie.from.robot, pose);
  motion.votes = kVotesOfDatum;
  motion.strength = by_closures.strength;
  return motion;
}

std::map<RobotId, SE3> common_placement(const PairMotions& given) {
  const std::set<RobotId> robots = robots_of(given);
  if (robots.empty()) return {};
  const PairMotions pairs = with_confirmed_motions(given, robots);
  using Rank = std::tuple<bool, double, double, double>;
  std::vector<std::tuple<Rank, RobotId, RobotId>> order;
  const PairMotions voting = agreeing(pairs);
  for (const auto& [pair, motion] : pairs) {
    const double confirmed = motion.votes >= kVotesOfDatum ? static_cast<double>(robots.size())
                             : has_vote(motion)            ? support(voting, robots, pair)
                                                           : 0.0;
    order.emplace_back(Rank{!has_vote(motion), confirmed < kConfirming ? 0.0 : -confirmed,
                            -motion.votes, motion.spread_m},
                       pair.first, pair.second);
  }
  std::ranges::sort(order);
  std::map<RobotId, SE3> placed{{*robots.begin(), SE3::Identity()}};
  for (bool grown = true; grown;) {  // Prim: the best pair that reaches another robot
    grown = false;
    for (const auto& [rank, a, b] : order) {
      if (placed.contains(a) == placed.contains(b)) continue;
      const auto [from, to] = placed.contains(a) ? std::pair(a, b) : std::pair(b, a);
      placed[to] = placed.at(from) * motion_between(pairs, from, to);
      grown = true;
      break;
    }
  }
  return placed;
}

Precision usual_strength(const PairMotions& all) {
  const PairMotions pairs = agreeing(all);
  const std::set<RobotId> robots = robots_of(pairs);
  if (robots.size() < kEnoughToOutvote) return kUnlimited;
  std::map<RobotId, std::vector<Precision>> of_robot;
  for (const auto& [ends, pair] : pairs) {
    if (pair.strength.tau == 0.0 || support(pairs, robots, ends) < kConfirming) continue;
    for (const RobotId robot : {ends.first, ends.second}) of_robot[robot].push_back(pair.strength);
  }
  if (of_robot.empty()) return kUnlimited;
  std::vector<Precision> medians;
  for (const auto& [robot, strengths] : of_robot) medians.push_back(lower_median(strengths));
  return lower_median(medians);
}

void limit_precisions(SessionGraph& graph) {
  if (graph.step_precision.size() < kMajority) return;
  const auto claimed_by = [&](RobotId robot) {
    const Precision step = graph.step_precision[robot], noise = graph.odometry_precision[robot];
    return Precision{step.kappa / noise.kappa, step.tau / noise.tau};
  };
  const Precision own = claimed_by(graph.self);
  std::vector<Precision> claims;
  for (const auto& [robot, step] : graph.step_precision) claims.push_back(claimed_by(robot));
  const Precision usual = lower_median(claims);
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
