#include "modules/pose_graph/robust/gnc_agent.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {
namespace {

// Rounds of the solve before update u count from u times this: late shares are recognised.
constexpr std::uint32_t kRoundsPerSolve = 1U << 16U;

// Second derivatives of a problem that is left half solved are not worth a second exchange.
constexpr double kPatience = 1e9;

// [sigma^2], of the whole team's cost: no decision hangs on it.
constexpr double kNegligible = 1e-9;

// No step promises a decrease by this multiple of the cost.
constexpr double kChordalOnly = 1e30;

}  // namespace

GncAgent::GncAgent(GncEdges edges, std::set<RobotId> team, int dimension,
                   const GncAgentOptions& options, std::vector<SE3> start)
    : edges_(std::move(edges)),
      team_(std::move(team)),
      dimension_(dimension),
      options_(options),
      poses_(std::move(start)) {
  check(options_.gnc);
  team_.insert(edges_.edges.self);
  bool fits = edges_.own_odometry.size() == edges_.edges.own.size();
  for (const auto& [peer, list] : edges_.edges.to)
    fits = fits && edges_.odometry_to[peer].size() == list.size();
  if (!fits) throw std::invalid_argument("GncAgent: flags and edges differ in number");
  if (!poses_.empty() && static_cast<Eigen::Index>(poses_.size()) != edges_.edges.poses)
    throw std::invalid_argument("GncAgent: " + std::to_string(poses_.size()) + " start poses for " +
                                std::to_string(edges_.edges.poses));
}

NewtonHello GncAgent::hello() const {
  const RobotId self = edges_.edges.self;
  NewtonHello hello{.robot = self};
  std::set<KeyframeIndex> poses;
  for (const bool odometry : {false, true})  // candidates first
    for (const auto& [peer, list] : edges_.edges.to)
      for (std::size_t k = 0; k < list.size(); ++k) {
        poses.insert(list[k].own);
        if (peer > self && edges_.odometry_to.at(peer)[k] == odometry)
          hello.links.push_back({{self, list[k].own}, {peer, list[k].other}});
      }
  hello.poses.assign(poses.begin(), poses.end());
  if (!poses_.empty())
    for (const KeyframeIndex k : hello.poses) hello.T_world_pose.push_back(poses_[k]);
  return hello;
}

void GncAgent::receive(const NewtonHello& hello) {
  if (team_.contains(hello.robot)) hellos_.try_emplace(hello.robot, hello);
}

void GncAgent::receive(const GncPoses& poses) {
  if (!team_.contains(poses.robot) || poses.update < update_) return;
  public_poses_[poses.update].try_emplace(poses.robot, poses);
}

void GncAgent::receive(const GncResiduals& residuals) {
  if (!team_.contains(residuals.robot) || residuals.update < update_) return;
  residuals_[residuals.update].try_emplace(residuals.robot, residuals);
}

void GncAgent::receive(std::shared_ptr<const NewtonShare> share) {
  const std::uint32_t solve = share->round / kRoundsPerSolve;
  if (solver_ && solve == update_)
    solver_->receive(std::move(share));
  else if (solve > update_ || (solve == update_ && !solver_))
    early_.push_back(std::move(share));
}

bool GncAgent::ready() const {
  const auto complete = [&](const auto& messages) {
    const auto found = messages.find(update_);
    return found != messages.end() && found->second.size() == team_.size();
  };
  switch (phase_) {
    case Phase::kHello:
      return hellos_.size() == team_.size();
    case Phase::kSolve:
      return solver_->ready();
    case Phase::kPoses:
      return complete(public_poses_);
    case Phase::kResiduals:
      return complete(residuals_);
    case Phase::kDone:
      return false;
  }
  return false;
}

std::optional<GncAgent::Message> GncAgent::advance() {
  if (!ready()) return std::nullopt;
  switch (phase_) {
    case Phase::kHello:
      if (poses_.empty()) return start_solve();
      for (const auto& [robot, hello] : hellos_)
        public_poses_[update_].try_emplace(robot, GncPoses{robot, update_, hello.T_world_pose});
      [[fallthrough]];
    case Phase::kPoses:
      phase_ = Phase::kResiduals;
      return residuals();
    case Phase::kResiduals:
      return update();
    case Phase::kSolve:
      return continue_solve(solver_->advance());
    case Phase::kDone:
      break;
  }
  return std::nullopt;
}

std::optional<GncAgent::Message> GncAgent::update() {
  if (!schedule_) make_schedule();
  std::vector<float> all;
  for (const auto& [robot, told] : residuals_.at(update_))
    all.insert(all.end(), told.residuals.begin(), told.residuals.end());
  (void)schedule_->update(all);
  ++update_;
  public_poses_.erase(public_poses_.begin(), public_poses_.lower_bound(update_ - 1));
  residuals_.erase(residuals_.begin(), residuals_.lower_bound(update_));
  return start_solve();
}

std::optional<GncAgent::Message> GncAgent::start_solve() {
  NewtonOptions newton;
  newton.first_round = update_ * kRoundsPerSolve;
  newton.absolute_tolerance = kNegligible;
  if (!schedule_ || !schedule_->decided()) {
    newton.tolerance = schedule_ ? options_.tolerance : kChordalOnly;
    newton.patience_rounds = kPatience;
  }
  solver_.emplace(weighted_edges(), team_, dimension_, newton, poses_);
  for (const auto& [robot, hello] : hellos_) solver_->receive(weighted_hello(hello));
  for (auto& share : std::exchange(early_, {})) receive(std::move(share));
  phase_ = Phase::kSolve;
  return continue_solve(solver_->advance());
}

std::optional<GncAgent::Message> GncAgent::continue_solve(std::optional<NewtonShare> share) {
  if (share) return std::move(*share);
  if (!solver_->done()) return std::nullopt;
  poses_ = solver_->poses();
  if (schedule_ && schedule_->decided()) {
    phase_ = Phase::kDone;
    return std::nullopt;
  }
  phase_ = Phase::kPoses;
  return public_poses();
}

GncPoses GncAgent::public_poses() const {
  GncPoses message{.robot = edges_.edges.self, .update = update_};
  for (const KeyframeIndex k : hellos_.at(edges_.edges.self).poses)
    message.T_world_pose.push_back(poses_[k]);
  return message;
}

}  // namespace km
