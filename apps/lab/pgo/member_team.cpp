#include "apps/lab/pgo/member_team.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "modules/session/team_plan.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

using Eigen::Index;

MemberTeam::MemberTeam(const TeamGraph& graph, std::vector<SE3> start, const Factory& make)
    : graph_(graph), parts_(graph.robots()) {
  if (static_cast<Index>(start.size()) != graph.poses())
    throw std::invalid_argument("MemberTeam: " + std::to_string(start.size()) +
                                " start poses for " + std::to_string(graph.poses()));
  for (std::size_t k = 0; k < parts_.size(); ++k) parts_[k] = part_of(graph, k);
  places_ = places();
  announce_starts(std::move(start));
  for (std::size_t k = 0; k < parts_.size(); ++k)
    members_.push_back(make(parts_[k], places_.at(k)));
}

// Places in the tree that the robots' own plan_tree() computes.
std::map<std::size_t, TreePlace> MemberTeam::places() const {
  std::map<RobotId, TeamStatus> statuses;
  TeamLinks links;
  for (const SessionGraph& part : parts_) {
    TeamStatus& status = statuses[part.self];
    status.sender = {part.self, 1};
    std::map<RobotId, std::uint32_t> edges;
    for (const PoseEdge& e : part.between) ++edges[e.other(part.self).robot];
    for (const auto& [peer, count] : edges) status.offers.push_back({peer, count, {1, count}});
    std::set<RobotId> received;
    for (const SessionGraph& other : parts_)
      if (other.self != part.self) received.insert(other.self);
    links.report(part.self, received);
  }
  SessionPlan plan = plan_session(statuses, 0);
  plan_tree(plan, statuses, links);
  if (plan.members.size() != parts_.size())
    throw std::invalid_argument("MemberTeam: the graph does not join all robots");
  std::map<std::size_t, TreePlace> places;
  for (std::size_t k = 0; k < parts_.size(); ++k)
    places[k] = place_in(plan, static_cast<RobotId>(k)).value();
  return places;
}

// Sends all public poses to all robots in single precision, as MemberPoses does.
void MemberTeam::announce_starts(std::vector<SE3> start) {
  std::set<KeyframeId> ends;
  for (const SessionGraph& part : parts_)
    for (const PoseEdge& e : part.between) ends.insert({e.from, e.to});
  std::map<KeyframeId, SE3> public_poses;
  for (const KeyframeId& id : ends) {
    SE3& T = start[static_cast<std::size_t>(graph_.first[id.robot] + id.index)];
    T = SinglePose::of(T).pose();
    public_poses[id] = T;
  }
  to_announce_ = kPoseBytes * ends.size();
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    parts_[k].start.assign(start.begin() + graph_.first[k], start.begin() + graph_.first[k + 1]);
    parts_[k].public_poses.clear();
    for (const PoseEdge& e : parts_[k].between) {
      const KeyframeId& other = e.other(parts_[k].self);
      parts_[k].public_poses[other] = public_poses.at(other);
    }
  }
}

std::vector<SE3> MemberTeam::poses() const {
  std::vector<SE3> poses;
  for (const auto& member : members_)
    poses.insert(poses.end(), member->poses().begin(), member->poses().end());
  return poses;
}

int MemberTeam::step(RoundMeter& meter) {
  if (done()) return 0;
  meter.sent(std::exchange(to_announce_, 0));
  const std::uint32_t before = rounds_;
  const std::uint32_t round = rounds_ + 1;
  const auto arrived = [&] {
    return std::all_of(members_.begin(), members_.end(),
                       [&](const auto& m) { return m->done() || m->state().round >= round; });
  };
  while (!arrived())
    if (!pass_on(round, meter))
      throw std::runtime_error("MemberTeam: the members wait for each other");
  for (std::size_t k = 0; k < members_.size(); ++k)
    if (!places_.at(k).parent) state_ = members_[k]->state();
  // A solver may publish its state every few rounds only.
  rounds_ = std::max(round, state_.round);
  return static_cast<int>(rounds_ - before);
}

bool MemberTeam::done() const {
  return std::all_of(members_.begin(), members_.end(), [](const auto& m) { return m->done(); });
}

// Every member that is ready advances, except for members that have completed `round` already.
bool MemberTeam::pass_on(std::uint32_t round, RoundMeter& meter) {
  bool worked = !in_flight_.empty();
  for (const Delivery& delivery : std::exchange(in_flight_, {})) {
    const bool taken = meter.run(delivery.message.to, [&] {
      return members_[delivery.message.to]->receive(delivery.from, *delivery.message.bytes);
    });
    if (!taken)
      throw std::runtime_error("MemberTeam: robot " + std::to_string(delivery.message.to) +
                               " refuses a message of robot " + std::to_string(delivery.from));
  }
  for (std::size_t k = 0; k < members_.size(); ++k) {
    if (members_[k]->state().round >= round || !members_[k]->ready()) continue;
    worked = true;
    for (SolverMessage& message : meter.run(k, [&] { return members_[k]->advance(); })) {
      meter.sent(message.bytes->size());
      in_flight_.push_back({static_cast<RobotId>(k), std::move(message)});
    }
  }
  meter.finish_exchange();
  return worked;
}

std::vector<TeamRound> run_team(const TeamGraph& graph, MemberTeam& team, int max_rounds,
                                const TeamMeter& meter) {
  return run_rounds(
      graph, [&] { return team.poses(); }, [&](RoundMeter& round) { return team.step(round); },
      max_rounds, meter);
}

}  // namespace km
