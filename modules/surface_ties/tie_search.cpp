#include "modules/surface_ties/tie_search.hpp"

#include <algorithm>

#include "modules/core/covariance.hpp"

namespace km {
namespace {

bool are_within(const KeyframeId& a, const KeyframeId& b, KeyframeIndex keyframes) {
  if (a.robot != b.robot) return false;
  return (a.index < b.index ? b.index - a.index : a.index - b.index) <= keyframes;
}

// Total variance of the position, by which ties are compared.
double position_variance(const Closure& tie) {
  return tie.covariance.bottomRightCorner<3, 3>().trace();
}

// Total variance of the position by odometry, for two keyframes of one robot.
double odometry_variance(const Closure& tie) {
  const UncertainPose odometry = between_on_chain({tie.from.T_odom_kf, tie.from.covariance},
                                                  {tie.to.T_odom_kf, tie.to.covariance});
  return odometry.Sigma.bottomRightCorner<3, 3>().trace();
}

}  // namespace

TieSearch::TieSearch(RobotId self, KeyframeIndex max_gap_keyframes,
                     const SurfaceTieOptions& options)
    : self_(self), max_gap_keyframes_(max_gap_keyframes), options_(options) {}

void TieSearch::learn(const OdometryPose& keyframe) {
  pieces_of(self_).learn(keyframe);
}

RigidPieces& TieSearch::pieces_of(RobotId robot) {
  return pieces_.try_emplace(robot, options_.spacing_m, max_gap_keyframes_).first->second;
}

void TieSearch::add(const MeshChunk& chunk, double now_s) {
  add_to_pieces(chunk.key.robot, chunk.boot, chunk, now_s);
}

void TieSearch::add(const MeshPoses& poses, double now_s) {
  add_to_pieces(poses.robot, poses.boot, poses, now_s);
}

template <typename Message>
void TieSearch::add_to_pieces(RobotId robot, std::uint64_t boot, const Message& message,
                              double now_s) {
  if (robot < self_) return;  // that robot makes the ties
  const auto [known, is_new] = boots_.try_emplace(robot, boot);
  if (known->second != boot) {
    forget(robot);
    boots_[robot] = boot;
  }
  for (const KeyframeIndex number : pieces_of(robot).add(message)) {
    versions_[{robot, number}] = {++changes_, now_s};
    is_done_ = false;
  }
}

void TieSearch::add(const ClosureId& closure) {
  if (closure.from.robot == self_) closures_.insert(closure);
}

void TieSearch::forget(RobotId robot) {
  pieces_.erase(robot);
  boots_.erase(robot);
  std::erase_if(versions_, [&](const auto& entry) { return entry.first.first == robot; });
  std::erase_if(tried_, [&](const auto& entry) { return entry.first.other == robot; });
  std::erase_if(found_, [&](const auto& entry) { return entry.first.other == robot; });
  for (auto* ids : {&closures_, &ties_})
    std::erase_if(*ids, [&](const ClosureId& id) { return touches(id, robot); });
}

bool TieSearch::is_joined(RobotId robot) const {
  return std::ranges::find(joined_, robot) != joined_.end();
}

// Pairs of pieces near each other that are to be registered now or later.
std::vector<TieSearch::Pair> TieSearch::open_pairs(bool inside) const {
  std::vector<Pair> pairs;
  if (!pieces_.contains(self_)) return pairs;
  for (const auto& [robot, pieces] : pieces_)
    if ((robot == self_) == inside) add_open_pairs(robot, pieces, pairs);
  return pairs;
}

void TieSearch::add_open_pairs(RobotId robot, const RigidPieces& pieces,
                               std::vector<Pair>& pairs) const {
  if (!is_joined(robot)) return;
  for (const auto& [a, box_a] : pieces_.at(self_).boxes())
    for (const auto& [b, box_b] : pieces.boxes()) {
      if (robot == self_ && a >= b) continue;
      if (box_a.exteriorDistance(box_b) < options_.reach_m && is_open({robot, a, b}))
        pairs.push_back({robot, a, b});
    }
}

void TieSearch::set_joined(std::vector<RobotId> robots) {
  is_done_ &= robots == joined_;
  joined_ = std::move(robots);
}

std::uint64_t TieSearch::version_of(const Pair& pair) const {
  return std::max(versions_.at({self_, pair.own}).number,
                  versions_.at({pair.other, pair.peer}).number);
}

// True if the pair is to be registered: it has changed since, and no closure or tie excludes it.
bool TieSearch::is_open(const Pair& pair) const {
  const auto tried = tried_.find(pair);
  if (tried != tried_.end() && tried->second >= version_of(pair)) return false;
  const KeyframeIndex middle = RigidPieces::kLength / 2;
  return !is_tied({{self_, pair.own * RigidPieces::kLength + middle},
                   {pair.other, pair.peer * RigidPieces::kLength + middle}});
}

bool TieSearch::is_calm(const Pair& pair, double now_s) const {
  return now_s - versions_.at({self_, pair.own}).changed_s >= kCalm_s &&
         now_s - versions_.at({pair.other, pair.peer}).changed_s >= kCalm_s;
}

bool TieSearch::is_tied(const ClosureId& tie) const {
  const KeyframeIndex first = tie.from.index > kNear ? tie.from.index - kNear : 0;
  const KeyframeId last{tie.from.robot, tie.from.index + kNear};
  for (auto known = closures_.lower_bound({{tie.from.robot, first}, {0, 0}});
       known != closures_.end() && known->from <= last; ++known)
    if (are_within(known->to, tie.to, kNear)) return true;
  return std::ranges::any_of(ties_, [&](const ClosureId& known) {
    return known.to.robot == tie.to.robot && (are_within(known.from, tie.from, kApart - 1) ||
                                              are_within(known.to, tie.to, kApart - 1));
  });
}

std::optional<Closure> TieSearch::lay(const Pair& pair) {
  tried_[pair] = version_of(pair);
  const RigidPiece own = pieces_.at(self_).piece(pair.own);
  const RigidPiece peer = pieces_.at(pair.other).piece(pair.peer);
  if (own.anchor != peer.anchor) return std::nullopt;
  SurfaceTieOptions options = options_;
  if (pair.other == self_) options.max_gap_keyframes = max_gap_keyframes_;
  const SE3 guess = own.keyframe.T_world_kf.inverse() * peer.keyframe.T_world_kf;
  const SurfaceTie tie = tie_surfaces(own.samples, peer.samples, guess, options);
  if (tie.status != SurfaceTieStatus::kTied) return std::nullopt;
  const auto independent =
      static_cast<int>(static_cast<double>(tie.pairs) / options.samples_per_error());
  const Closure closure{.from = own.keyframe.odometry,
                        .to = peer.keyframe.odometry,
                        .T_from_to = tie.T_a_b,
                        .covariance = tie.covariance,
                        .inliers = std::max(1, independent)};
  double most = 3.0 * kMaxSigma_m * kMaxSigma_m;
  if (pair.other == self_) most = std::min(most, odometry_variance(closure));
  if (position_variance(closure) > most) return std::nullopt;
  return closure;
}

// The best tie comes first, so that a small overlap does not exclude a large one.
std::optional<Closure> TieSearch::take_best(bool inside) {
  std::erase_if(found_, [&](const auto& entry) {
    return is_tied(entry.second.id()) || !is_joined(entry.first.other);
  });
  auto best = found_.end();
  for (auto found = found_.begin(); found != found_.end(); ++found)
    if ((found->first.other == self_) == inside &&
        (best == found_.end() ||
         position_variance(found->second) < position_variance(best->second)))
      best = found;
  if (best == found_.end()) return std::nullopt;
  const Closure tie = best->second;
  found_.erase(best);
  ties_.insert(tie.id());
  return tie;
}

// Ties between robots come first, because no odometry knows the relative poses of robots.
std::optional<Closure> TieSearch::step(double now_s) {
  if (is_done_) return std::nullopt;
  bool is_any_open = false;
  for (const bool inside : {false, true}) {
    const std::vector<Pair> open = open_pairs(inside);
    for (const Pair& pair : open) {
      if (!is_calm(pair, now_s)) continue;
      if (auto tie = lay(pair)) found_.insert_or_assign(pair, *std::move(tie));
      return std::nullopt;
    }
    if (auto tie = take_best(inside)) return tie;
    is_any_open |= !open.empty();
  }
  is_done_ = !is_any_open;
  return std::nullopt;
}

}  // namespace km
