#include "modules/rbcd/member_rbcd.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>

#include "modules/rbcd/stiefel.hpp"
#include "modules/rbcd/truncated_newton.hpp"

namespace km {
namespace {

enum class RbcdMessageKind : std::uint8_t { kPoses, kShare, kProgress };

constexpr int kNewtonSteps = 3;    // in one block update
constexpr int kCgIterations = 50;  // in one Newton step
// Perturbation of the start, see perturb_rotations(): small relative to any measurement, large
// relative to round-off errors.
constexpr double kPerturbation = 1e-3;
// kProgressPeriod: number of rounds between two progress messages of the root. kMaxAhead: number of
// rounds by which a member is at most ahead of the round in the last progress message. The member
// keeps its poses of all these rounds.
constexpr std::uint32_t kProgressPeriod = 5;
constexpr std::uint32_t kMaxAhead = 20;
// Received poses are off their manifold only by rounding.
constexpr double kMaxStiefelError = 1e-3;

// The perturbed start of a keyframe, equal on all robots that know its start.
Eigen::MatrixXd perturbed(const SE3& start, const KeyframeId& keyframe, Eigen::Index rank) {
  std::mt19937 rng((std::uint32_t{keyframe.robot} << 16U) ^ keyframe.index);
  return perturb_rotations(lift(lifted_identity(rank), start), kPerturbation, rng);
}

ByteWriter begin_message(RbcdMessageKind kind, std::uint32_t round) {
  ByteWriter writer;
  writer.u8(static_cast<std::uint8_t>(kind));
  writer.varint(round);
  return writer;
}

SolverMessage addressed(RobotId to, ByteWriter writer) {
  return {to, std::make_shared<const std::vector<std::uint8_t>>(writer.release())};
}

}  // namespace

MemberRbcd::MemberRbcd(SessionGraph graph, const TreePlace& place, const RbcdOptions& options)
    : graph_(std::move(graph)),
      place_(place),
      options_(options),
      problem_(make_problem()),
      poses_(graph_.start) {
  LiftedPoses X = lifted_start();
  problem_.set_fixed(fixed_);
  history_.emplace(0, std::move(X));
}

QuadraticProblem MemberRbcd::make_problem() {
  if (options_.rank < 3) throw std::invalid_argument("MemberRbcd: a rank below 3");
  const auto weight = [&](const PoseEdge& e) {
    const auto decided = graph_.decided.find(e.id());
    return decided != graph_.decided.end() && !decided->second ? kRejectedWeight : 1.0;
  };
  std::vector<BlockEdge> own;
  for (std::size_t k = 0; k < graph_.own.size(); ++k) {
    const PoseEdge& e = graph_.own[k];
    const double w = k < graph_.odometry ? 1.0 : weight(e);
    own.push_back(
        {e.from.index, e.to.index, e.T_from_to, w * e.precision.kappa, w * e.precision.tau});
  }
  for (const PoseEdge& fix : graph_.fixes) own.push_back(BlockEdge::of(fix));
  std::vector<PublicEdge> to_others;
  Eigen::Index slots = 0;
  for (const auto* edges : {&graph_.between, &graph_.datum_ties, &graph_.to_absent})
    for (const PoseEdge& e : *edges) {
      const KeyframeId other = e.other(graph_.self);
      const KeyframeIndex at = e.end_on(graph_.self).index;
      Neighbour& neighbour = neighbours_[other.robot];
      neighbour.absent = edges == &graph_.to_absent;
      neighbour.updates_before = !neighbour.absent && other.robot < graph_.self;
      neighbour.own.push_back(at);
      const auto [slot, is_new] = neighbour.slot_of.try_emplace(other.index, slots);
      if (is_new) ++slots;
      const double w = weight(e);
      to_others.push_back({at, slot->second, e.from.robot == graph_.self, e.T_from_to,
                           w * e.precision.kappa, w * e.precision.tau});
      robot_of_edge_.push_back(other.robot);
    }
  fixed_.resize(options_.rank, 4 * slots);
  for (auto& [robot, neighbour] : neighbours_) {
    std::ranges::sort(neighbour.own);
    neighbour.own.erase(std::unique(neighbour.own.begin(), neighbour.own.end()),
                        neighbour.own.end());
    for (const auto& [keyframe, slot] : neighbour.slot_of) {
      const KeyframeId id{robot, keyframe};
      const auto found = graph_.public_poses.find(id);
      if (found == graph_.public_poses.end())
        throw std::invalid_argument("MemberRbcd: keyframe " + to_string(id) +
                                    " has no published pose");
      fixed_.middleCols<4>(4 * slot) = neighbour.absent
                                           ? lift(lifted_identity(options_.rank), found->second)
                                           : perturbed(found->second, id, options_.rank);
    }
  }
  return {options_.rank, static_cast<Eigen::Index>(graph_.start.size()), std::move(own),
          std::move(to_others), graph_.upright ? graph_.verticals : std::vector<VerticalPrior>()};
}

LiftedPoses MemberRbcd::lifted_start() const {
  LiftedPoses X(options_.rank, 4 * static_cast<Eigen::Index>(graph_.start.size()));
  for (std::size_t i = 0; i < graph_.start.size(); ++i)
    X.middleCols<4>(4 * static_cast<Eigen::Index>(i)) =
        perturbed(graph_.start[i], {graph_.self, static_cast<KeyframeIndex>(i)}, options_.rank);
  return X;
}

bool MemberRbcd::is_member(RobotId robot) const {
  return std::ranges::binary_search(place_.members, robot);
}

bool MemberRbcd::can_update() const {
  const std::uint32_t round = history_.rbegin()->first;
  if (round >= state_.round + kMaxAhead) return false;
  if (options_.max_rounds > 0 && round >= options_.max_rounds) return false;
  return std::ranges::all_of(neighbours_, [&](const auto& of_robot) {
    const Neighbour& neighbour = of_robot.second;
    return neighbour.absent || neighbour.round >= round + (neighbour.updates_before ? 1 : 0);
  });
}

bool MemberRbcd::round_is_complete() const {
  const auto shares = shares_.find(last_ ? last_->round + 1 : 0);
  return shares != shares_.end() && shares->second.size() == place_.members.size();
}

bool MemberRbcd::ready() const {
  return !done_ &&
         (!started_ || can_update() || round_is_complete() || pending_.contains(state_.round));
}

std::vector<SolverMessage> MemberRbcd::advance() {
  std::vector<SolverMessage> messages;
  if (done_) return messages;
  if (!std::exchange(started_, true)) report_share(0.0, messages);
  if (const auto next = pending_.extract(state_.round)) adopt(next.mapped());
  if (!done_ && can_update()) update(messages);
  for (bool reported = false; !reported && round_is_complete();) reported = close_round(messages);
  return messages;
}

void MemberRbcd::update(std::vector<SolverMessage>& messages) {
  const auto& [round, X] = *history_.rbegin();
  problem_.set_fixed(fixed_);
  const bool alone = place_.members.size() == 1;
  TruncatedNewtonResult result = minimise_over_relaxed(
      problem_, X, {.max_iterations = kNewtonSteps, .max_cg_iterations = kCgIterations},
      alone ? 1.0 : relaxation_after(round, options_.max_over_relaxation));
  if (!std::isfinite(result.cost)) throw std::runtime_error("MemberRbcd: the cost is not finite");
  history_.emplace_hint(history_.end(), round + 1, std::move(result.X));
  const auto rounded = round_public_poses();
  for (const auto& [robot, neighbour] : neighbours_) {
    if (neighbour.absent) continue;
    ByteWriter writer = begin_message(RbcdMessageKind::kPoses, history_.rbegin()->first);
    for (const KeyframeIndex keyframe : neighbour.own)
      for (const float x : rounded.at(keyframe).reshaped()) writer.f32(x);
    messages.push_back(addressed(robot, std::move(writer)));
  }
  report_share(result.initial_gradient_norm * result.initial_gradient_norm, messages);
}

// Rounds the public poses to single precision. This robot continues from the rounded poses, which
// are bit by bit those that the other robots decode.
std::map<KeyframeIndex, Eigen::MatrixXf> MemberRbcd::round_public_poses() {
  LiftedPoses& X = history_.rbegin()->second;
  std::map<KeyframeIndex, Eigen::MatrixXf> rounded;
  for (const auto& [robot, neighbour] : neighbours_) {
    if (neighbour.absent) continue;
    for (const KeyframeIndex keyframe : neighbour.own) {
      if (rounded.contains(keyframe)) continue;
      auto pose = X.middleCols<4>(4 * Eigen::Index{keyframe});
      const Eigen::MatrixXf& sent = rounded[keyframe] = pose.cast<float>();
      pose = restore_stiefel(sent.cast<double>());
    }
  }
  return rounded;
}

void MemberRbcd::report_share(double squared_gradient, std::vector<SolverMessage>& messages) {
  const auto& [round, X] = *history_.rbegin();
  // Round 0 has the cost of the rigid start, because a session without improvement ends with it.
  const LiftedPoses start = round == 0 ? lift(graph_.start, options_.rank) : LiftedPoses();
  const LiftedPoses& at = round == 0 ? start : X;
  if (round == 0) {
    LiftedPoses fixed = fixed_;
    for (const auto& [robot, neighbour] : neighbours_)
      for (const auto& [keyframe, slot] : neighbour.slot_of)
        fixed.middleCols<4>(4 * slot) =
            lift(lifted_identity(options_.rank), graph_.public_poses.at({robot, keyframe}));
    problem_.set_fixed(std::move(fixed));
  }
  // The cost of the edges between two neighbours is counted by the robot that updates last.
  Share share{problem_.cost(at), squared_gradient, !graph_.to_absent.empty()};
  for (std::size_t k = 0; k < robot_of_edge_.size(); ++k) {
    const Neighbour& neighbour = neighbours_.at(robot_of_edge_[k]);
    if (!neighbour.absent && !neighbour.updates_before)
      share.cost -= problem_.public_edge_cost(k, at);
  }
  if (is_root()) {
    shares_[round][graph_.self] = share;
    return;
  }
  ByteWriter writer = begin_message(RbcdMessageKind::kShare, round);
  writer.f64(share.cost);
  writer.f64(share.squared_gradient);
  writer.u8(share.held ? 1 : 0);
  messages.push_back(addressed(place_.root, std::move(writer)));
}

// Sums the shares of the next complete round. True if it is reported to the members.
bool MemberRbcd::close_round(std::vector<SolverMessage>& messages) {
  const auto shares = shares_.extract(shares_.begin());
  const std::uint32_t round = shares.key();
  Total total;
  for (const auto& [robot, share] : shares.mapped()) {
    total.cost += share.cost;
    total.gradient += share.squared_gradient;
    held_ |= share.held;
  }
  total.gradient = std::sqrt(total.gradient);
  const auto last = std::exchange(last_, RoundTotal{round, total});
  if (!last) {
    start_ = total;
    return false;
  }
  const double decrease = last->total.cost - total.cost;
  // The perturbation of the rigid start may cost more than the first round gains.
  const bool settled = round > 1 && !(decrease > options_.min_relative_decrease * total.cost);
  const bool stop = settled || (options_.max_rounds > 0 && round >= options_.max_rounds);
  if (!stop && round % kProgressPeriod != 0) return false;
  const RoundTotal& better = decrease < 0.0 ? *last : *last_;
  report_progress(stop && start_.cost <= better.total.cost ? RoundTotal{0, start_} : better, stop,
                  messages);
  return true;
}

void MemberRbcd::report_progress(const RoundTotal& at, bool stop,
                                 std::vector<SolverMessage>& messages) {
  const Progress progress{at, state_.round, stop, anchor_at(at.round)};
  for (const RobotId robot : place_.members) {
    if (robot == graph_.self) continue;
    ByteWriter writer = begin_message(RbcdMessageKind::kProgress, at.round);
    writer.varint(progress.before);
    writer.u8(stop ? 1 : 0);
    writer.f64(at.total.cost);
    writer.f64(at.total.gradient);
    for (const double x : progress.anchor.reshaped()) writer.f64(x);
    messages.push_back(addressed(robot, std::move(writer)));
  }
  adopt(progress);
}

Eigen::MatrixXd MemberRbcd::anchor_at(std::uint32_t round) const {
  if (held_ || round == 0) return lifted_identity(options_.rank);
  const SE3& first = graph_.start.front();
  const Eigen::MatrixXd anchor = lift(history_.at(round).leftCols<4>(), first.inverse());
  return graph_.upright ? level(anchor, first.translation()) : anchor;
}

void MemberRbcd::adopt(const Progress& progress) {
  const auto& [round, total] = progress.at;
  poses_ = round == 0 ? graph_.start : round_to_poses(history_.at(round), progress.anchor);
  state_.round = round;
  state_.cost = total.cost;
  state_.gradient = total.gradient;
  done_ = progress.stop;
  if (!done_) history_.erase(history_.begin(), history_.find(round));
}

bool MemberRbcd::receive(RobotId from, std::span<const std::uint8_t> bytes) {
  if (from == graph_.self || !is_member(from)) return false;
  if (done_) return true;
  ByteReader reader(bytes);
  const std::uint8_t kind = reader.u8();
  const auto round = reader.varint_as<std::uint32_t>();
  switch (static_cast<RbcdMessageKind>(kind)) {
    case RbcdMessageKind::kPoses:
      return take_poses(from, round, reader);
    case RbcdMessageKind::kShare:
      return take_share(from, round, reader);
    case RbcdMessageKind::kProgress:
      return take_progress(from, round, reader);
  }
  return false;
}

bool MemberRbcd::take_poses(RobotId from, std::uint32_t round, ByteReader& reader) {
  const auto found = neighbours_.find(from);
  if (found == neighbours_.end() || found->second.absent) return false;
  Neighbour& neighbour = found->second;
  LiftedPoses X(options_.rank, 4 * static_cast<Eigen::Index>(neighbour.slot_of.size()));
  for (double& x : X.reshaped()) x = static_cast<double>(reader.f32());
  if (!reader.done() || !X.allFinite() || stiefel_error(X) > kMaxStiefelError) return false;
  if (round <= neighbour.round) return true;  // repeated
  // The neighbour waits for the next poses of this robot and therefore cannot be further ahead.
  const std::uint32_t own_round = history_.rbegin()->first;
  if (round > own_round + (neighbour.updates_before ? 1 : 0)) return false;
  X = restore_stiefel(std::move(X));
  Eigen::Index k = 0;
  for (const auto& [keyframe, slot] : neighbour.slot_of)
    fixed_.middleCols<4>(4 * slot) = X.middleCols<4>(4 * k++);
  neighbour.round = round;
  return true;
}

bool MemberRbcd::take_share(RobotId from, std::uint32_t round, ByteReader& reader) {
  Share share{reader.f64(), reader.f64()};
  const std::uint8_t held = reader.u8();
  share.held = held == 1;
  if (!is_root() || !reader.done() || held > 1 || !std::isfinite(share.cost) ||
      !(share.squared_gradient >= 0.0) || round > state_.round + kMaxAhead)
    return false;
  if (!last_ || round > last_->round) shares_[round].try_emplace(from, share);
  return true;
}

bool MemberRbcd::take_progress(RobotId from, std::uint32_t round, ByteReader& reader) {
  Progress progress{{round, {}}, 0, false, Eigen::MatrixXd(options_.rank, 4)};
  progress.before = reader.varint_as<std::uint32_t>();
  const std::uint8_t stop = reader.u8();
  progress.stop = stop == 1;
  progress.at.total.cost = reader.f64();
  progress.at.total.gradient = reader.f64();
  for (double& x : progress.anchor.reshaped()) x = reader.f64();
  if (from != place_.root || !reader.done() || stop > 1 || !progress.anchor.allFinite() ||
      !std::isfinite(progress.at.total.cost) || !(progress.at.total.gradient >= 0.0) ||
      stiefel_error(progress.anchor) > kMaxStiefelError)
    return false;
  if (progress.before < state_.round) return true;  // repeated
  const bool forward =
      progress.stop ? round == 0 || round >= progress.before : round > progress.before;
  // The root reports only rounds that all members have completed.
  if (!forward || std::max(round, progress.before) > history_.rbegin()->first) return false;
  pending_.try_emplace(progress.before, std::move(progress));
  return true;
}

}  // namespace km
