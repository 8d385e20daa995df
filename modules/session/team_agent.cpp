#include "modules/session/team_agent.hpp"

#include <algorithm>
#include <utility>

namespace km {
namespace {

void forget_measured(AgentState& s, RobotId robot) {
  s.graph.forget(robot);
  s.decisions.discard(robot);
  s.plan_outdated = true;
}

void meet(AgentState& s, const TeamPeer& peer) {
  switch (s.roster.meet(peer)) {
    case TeamRoster::Meeting::kKnown:
    case TeamRoster::Meeting::kNew:
      return;
    case TeamRoster::Meeting::kOtherIncarnation:
      forget_measured(s, peer.robot);
      break;
    case TeamRoster::Meeting::kOtherProcess:
      break;
  }
  s.plan_outdated = true;
}

bool take(AgentState& s, const TeamPeer& sender, const TeamStatus& status) {
  meet(s, sender);
  s.plan_outdated = true;
  s.roster.take(status);
  return !s.roster.at(sender.robot).other_method ||
         s.notices.refuse("robot " + std::to_string(sender.robot) +
                          " is configured for another method");
}

bool take(AgentState& s, const TeamPeer& sender, const Session& session) {
  meet(s, sender);
  if (session.method != s.config.method)
    return s.notices.refuse("a session of robot " + std::to_string(sender.robot) +
                            " with another method");
  s.roster.take(session);
  consider(s, session);
  return true;
}

bool take(AgentState& s, const TeamPeer& sender, const MemberPoses& poses) {
  meet(s, sender);
  s.plan_outdated = true;
  const auto is_member = [&] {
    return s.part && s.poses_of(sender.robot, MemberStage::kEntered) != nullptr;
  };
  const bool was_member = is_member();
  s.roster.take(poses);
  const bool of_session = s.in_session() && poses.session == s.part->session().id;
  if (poses.stage == MemberStage::kSolved && !of_session) s.roster.keep_result(sender.robot);
  s.deserted |= was_member && poses.session != s.part->session().id;
  if (!is_member()) return true;
  if (s.in_session()) s.part->cost().last_activity_s = s.now_s;
  if (s.is_solved()) decide_with(s, poses);
  return true;
}

bool take(AgentState& s, const TeamPeer& sender, const ReliableMessage& message) {
  if (!s.in_session() || message.session != s.part->session().id) return true;  // too early or late
  return s.part->receive(message, s.now_s) ||
         s.notices.refuse("a message of robot " + std::to_string(sender.robot) +
                          " that is of no use");
}

void send_status(AgentState& s, TeamOutput& output) {
  if (!s.status_schedule.may_be_due(s.now_s)) return;
  TeamStatus status = make_status(s);
  const StatusSchedule::Due due = s.status_schedule.due(status, s.now_s);
  if (due == StatusSchedule::Due::kNo) return;
  output.progress = make_progress(s);
  if (due == StatusSchedule::Due::kStatus) output.messages.emplace_back(std::move(status));
}

}  // namespace

TeamAgent::TeamAgent(const PoseGraphConfig& config, TeamPeer self, MemberSolverFactory factory,
                     int dimension)
    : state_(config, self, std::move(factory), dimension) {
  state_.roster.connect(state_.links.links);
}

bool TeamAgent::add(const KeyframeOdometry& keyframe) {
  AgentState& s = state_;
  const bool taken = s.graph.add(keyframe);
  s.plan_outdated |= taken;
  return taken || s.notices.refuse("a keyframe that is not the next one of this robot");
}

bool TeamAgent::add(const Closure& closure) {
  AgentState& s = state_;
  const ClosureId id = closure.id();
  const bool taken = s.graph.add(closure);
  s.plan_outdated |= taken;
  if (!taken && touches(id, s.self.robot) &&
      (id.from == id.to || !pose_edge(closure.relative_pose())))
    return s.notices.refuse("a closure that has no usable pose or covariance");
  if (!taken && touches(id, s.self.robot) && s.graph.is_full(id))
    return s.notices.refuse("closures of robots " + std::to_string(id.from.robot) + " and " +
                            std::to_string(id.to.robot) + " beyond the " +
                            std::to_string(OwnGraph::kMaxClosures) + " that are kept");
  return taken;
}

bool TeamAgent::add(const InlierSet& set) {
  AgentState& s = state_;
  const bool taken = s.graph.add(set);
  s.plan_outdated |= taken;
  const auto between = [&](const ClosureId& id) {
    return std::minmax(id.from.robot, id.to.robot) == std::minmax(set.a, set.b);
  };
  const bool concerns = set.a == s.self.robot || set.b == s.self.robot;
  if (!taken && concerns &&
      (set.a > set.b || !std::all_of(set.closures.begin(), set.closures.end(), between)))
    return s.notices.refuse("an inlier set with closures of other robots than it is about");
  return taken;
}

bool TeamAgent::add(const PositionFix& fix) {
  AgentState& s = state_;
  const bool taken = s.graph.add(fix);
  s.plan_outdated |= taken;
  return taken || s.notices.refuse("a fix that is not usable, or not after the last one");
}

void TeamAgent::restore(const TeamSolution& solution) {
  AgentState& s = state_;
  const Trajectory& own = solution.trajectory;
  s.awaited_keyframes = std::max<std::size_t>(own.T_world_kf.size(), 1);
  s.poses.restore(own.T_world_kf);
  s.world = World{own.anchor, SE3::Identity()};
  s.published_anchor = own.anchor;
  s.decisions.decide(solution.verdicts.closures);
  for (const TeamPeer& peer : solution.peers) {
    meet(s, peer);
    MemberPoses held{.sender = peer, .stage = MemberStage::kSolved, .frame = s.frame};
    for (const auto& [id, T_world_kf] : own.public_poses) {
      if (id.robot != peer.robot) continue;
      held.keyframes.push_back(id.index);
      held.T_frame_kf.push_back(SinglePose::of(T_world_kf));
    }
    if (held.keyframes.empty()) continue;
    s.roster.take(held);
    s.roster.keep_result(peer.robot);
  }
}

void TeamAgent::peer_alive(TeamPeer peer) {
  AgentState& s = state_;
  if (peer.robot == s.self.robot) return;
  meet(s, peer);
  s.direct[peer.robot] = peer.boot;
  if (!s.in_session()) return;
  // Messages to the members beyond the lost link may be lost, too.
  for (const RobotId member : s.part->members())
    if (member == peer.robot || !s.direct.contains(member)) s.part->reachable_again(member);
}

void TeamAgent::update_links(const LinksReport& links) {
  AgentState& s = state_;
  if (links.version <= s.links.version) return;
  s.links = links;
  s.roster.connect(s.links.links);
  s.plan_outdated = true;
}

void TeamAgent::peer_restarted(const TeamPeer& peer) {
  AgentState& s = state_;
  meet(s, peer);
  forget_measured(s, peer.robot);
}

bool TeamAgent::receive(const TeamMessage& message) {
  AgentState& s = state_;
  const TeamPeer sender = origin_of(message);
  const auto direct = s.direct.find(sender.robot);
  if (sender.robot == s.self.robot || (direct != s.direct.end() && direct->second != sender.boot))
    return s.notices.refuse("a message of robot " + std::to_string(sender.robot) +
                            " by another process than the one that is known");
  return std::visit([&](const auto& m) { return take(s, sender, m); }, message);
}

TeamOutput TeamAgent::step(double now_s, std::uint64_t sent_bytes) {
  AgentState& s = state_;
  s.now_s = now_s;
  if (s.part) s.part->cost().sent_bytes += sent_bytes - s.sent_bytes;
  s.sent_bytes = sent_bytes;
  TeamOutput output;
  const bool is_complete = s.graph.keyframes() >= s.awaited_keyframes;
  if (is_complete) {
    coordinate(s, output);
    advance(s, output);
    refine_alone(s);
  }
  send_status(s, output);
  if (is_complete) publish(s, output);
  output.verdicts = s.decisions.take_verdicts();
  output.notices = s.notices.take();
  output.news = s.notices.take_news();
  return output;
}

}  // namespace km
