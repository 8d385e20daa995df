#include "modules/pose_graph/robust/gnc_agent.hpp"

// Which edge a robot decides, by what number, and what follows for the weighted problem.

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string>

namespace km {
namespace {

std::size_t count_closures(const std::vector<bool>& odometry, std::size_t end) {
  return static_cast<std::size_t>(
      std::count(odometry.begin(), odometry.begin() + static_cast<std::ptrdiff_t>(end), false));
}

std::size_t count_closures(const std::vector<bool>& odometry) {
  return count_closures(odometry, odometry.size());
}

}  // namespace

const SE3& GncAgent::told_pose(RobotId robot, KeyframeIndex pose) const {
  const auto& poses = hellos_.at(robot).poses;
  const auto& told = public_poses_.at(update_).at(robot).T_world_pose;
  const auto found = std::lower_bound(poses.begin(), poses.end(), pose);
  const auto place = static_cast<std::size_t>(found - poses.begin());
  if (found == poses.end() || *found != pose || place >= told.size())
    throw std::invalid_argument("GncAgent: nobody told pose " + to_string(KeyframeId{robot, pose}));
  return told[place];
}

std::size_t GncAgent::index_of(RobotId robot) const {
  return static_cast<std::size_t>(std::distance(team_.begin(), team_.find(robot)));
}

GncResiduals GncAgent::residuals() const {
  const RobotEdges& edges = edges_.edges;
  GncResiduals message{.robot = edges.self, .update = update_};
  for (auto to = edges.to.upper_bound(edges.self); to != edges.to.end(); ++to)
    for (std::size_t k = 0; k < to->second.size(); ++k) {
      if (edges_.odometry_to.at(to->first)[k]) continue;
      const InterEdge& e = to->second[k];
      const SE3& own = poses_[e.own];
      const SE3& other = told_pose(to->first, e.other);
      message.residuals.push_back(static_cast<float>(edge_residual(
          e.from_own ? own : other, e.from_own ? other : own, e.T_from_to, e.kappa, e.tau)));
    }
  message.between = static_cast<std::uint32_t>(message.residuals.size());
  for (const bool odometry : {false, true}) {
    for (std::size_t k = 0; k < edges.own.size(); ++k) {
      if (edges_.own_odometry[k] != odometry || (odometry && !options_.reject_odometry)) continue;
      const BlockEdge& e = edges.own[k];
      message.residuals.push_back(static_cast<float>(
          edge_residual(poses_[static_cast<std::size_t>(e.i)],
                        poses_[static_cast<std::size_t>(e.j)], e.T_i_j, e.kappa, e.tau)));
    }
    if (!odometry)
      message.inside = static_cast<std::uint32_t>(message.residuals.size()) - message.between;
  }
  return message;
}

void GncAgent::make_schedule() {
  std::vector<GncCandidate> candidates;
  std::vector<GncCandidate> joined;
  for (const auto& [robot, told] : residuals_.at(update_)) {
    const std::vector<PublicLink>& links = hellos_.at(robot).links;
    const auto self = static_cast<RobotId>(index_of(robot));
    if (told.between > links.size() || told.between + told.inside > told.residuals.size())
      throw std::invalid_argument("GncAgent: robot " + std::to_string(robot) +
                                  " counts more closures than it has");
    deciders_[robot] = {candidates.size(), told.between};
    for (std::size_t k = 0; k < links.size(); ++k) {
      if (!team_.contains(links[k].b.robot))
        throw std::invalid_argument("GncAgent: robot " + std::to_string(robot) +
                                    " has a link to a robot outside the team");
      const GncCandidate pair{self, static_cast<RobotId>(index_of(links[k].b.robot))};
      (k < told.between ? candidates : joined).push_back(pair);
    }
    const std::size_t inside_end = told.between + told.inside;
    for (std::size_t k = told.between; k < told.residuals.size(); ++k)
      candidates.push_back({self, self, k >= inside_end});
  }
  schedule_.emplace(std::move(candidates), team_.size(), std::move(joined), options_.gnc,
                    dimension_);
}

std::optional<std::size_t> GncAgent::own_candidate(std::size_t edge) const {
  if (!schedule_) return std::nullopt;
  const std::vector<bool>& odometry = edges_.own_odometry;
  const Decider& self = deciders_.at(edges_.edges.self);
  const std::size_t closures_before = count_closures(odometry, edge);
  const std::size_t first = self.first + self.between;
  if (!odometry[edge]) return first + closures_before;
  if (!options_.reject_odometry) return std::nullopt;
  return first + count_closures(odometry) + edge - closures_before;
}

std::optional<std::size_t> GncAgent::candidate(RobotId peer, std::size_t edge) const {
  const std::vector<bool>& odometry = edges_.odometry_to.at(peer);
  if (!schedule_ || odometry[edge]) return std::nullopt;
  const RobotId self = edges_.edges.self;
  const Decider& decider = deciders_.at(std::min(self, peer));
  const auto& links = hellos_.at(std::min(self, peer)).links;
  const auto end = links.begin() + static_cast<std::ptrdiff_t>(decider.between);
  const auto to_higher = [&](const PublicLink& link) {
    return link.b.robot == std::max(self, peer);
  };
  const auto first = std::find_if(links.begin(), end, to_higher);
  const std::size_t place = count_closures(odometry, edge);
  if (static_cast<std::size_t>(std::count_if(first, end, to_higher)) != count_closures(odometry))
    throw std::invalid_argument("GncAgent: robots " + std::to_string(self) + " and " +
                                std::to_string(peer) + " do not have the same edges");
  return decider.first + static_cast<std::size_t>(first - links.begin()) + place;
}

bool GncAgent::kept_own(std::size_t edge) const {
  const auto k = own_candidate(edge);
  return !k || schedule_->kept(*k);
}

bool GncAgent::kept(RobotId peer, std::size_t edge) const {
  const auto k = candidate(peer, edge);
  return !k || schedule_->kept(*k);
}

RobotEdges GncAgent::weighted_edges() const {
  const auto weight_of = [&](const std::optional<std::size_t>& k) {
    return k ? schedule_->weight(*k) : 1.0;
  };
  const auto add = [](auto& list, auto edge, double weight) {
    if (weight == 0.0) return;
    edge.kappa *= weight;
    edge.tau *= weight;
    list.push_back(edge);
  };
  RobotEdges weighted{.self = edges_.edges.self, .poses = edges_.edges.poses};
  for (std::size_t k = 0; k < edges_.edges.own.size(); ++k)
    add(weighted.own, edges_.edges.own[k], weight_of(own_candidate(k)));
  for (const auto& [peer, list] : edges_.edges.to)
    for (std::size_t k = 0; k < list.size(); ++k)
      add(weighted.to[peer], list[k], weight_of(candidate(peer, k)));
  return weighted;
}

NewtonHello GncAgent::weighted_hello(const NewtonHello& hello) const {
  if (!schedule_) return hello;
  NewtonHello weighted{.robot = hello.robot, .poses = hello.poses};
  const Decider& decider = deciders_.at(hello.robot);
  for (std::size_t k = 0; k < hello.links.size(); ++k)
    if (k >= decider.between || schedule_->weight(decider.first + k) > 0.0)
      weighted.links.push_back(hello.links[k]);
  weighted.T_world_pose = public_poses_.at(update_ - 1).at(hello.robot).T_world_pose;
  return weighted;
}

}  // namespace km
