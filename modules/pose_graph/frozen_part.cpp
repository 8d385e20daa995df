#include "modules/pose_graph/frozen_part.hpp"

#include <algorithm>
#include <cstddef>
#include <set>

#include "modules/pose_graph/team_plan.hpp"

namespace km {
namespace {

// Adds the received poses of a robot that is not a member, and the closures to these poses.
void add_absent(const MemberPoses& poses, RobotId self, const std::vector<PoseEdge>& edges,
                SessionGraph& graph) {
  for (std::size_t k = 0; k < poses.keyframes.size(); ++k)
    graph.public_poses[{poses.sender.robot, poses.keyframes[k]}] = poses.T_frame_kf[k].pose();
  for (const PoseEdge& e : edges)
    if (graph.public_poses.contains(e.other(self))) graph.to_absent.push_back(e);
}

}  // namespace

std::optional<FrozenPart> freeze_part(const Session& session, RobotId self, const OwnGraph& graph,
                                      std::span<const RobotId> peers,
                                      const PublicPoses& published) {
  const SessionPlan& plan = session.plan;
  FrozenPart part{.place = *place_in(plan, self)};
  SessionGraph& frozen = part.graph;
  frozen.self = self;
  for (const SessionPair& pair : plan.pairs) {
    if (pair.a != self && pair.b != self) continue;
    const auto* edges = graph.edges(pair.a == self ? pair.b : pair.a, pair.edges);
    if (edges == nullptr) return std::nullopt;
    frozen.between.insert(frozen.between.end(), edges->begin(), edges->end());
  }
  std::ranges::sort(frozen.between, {}, &PoseEdge::id);
  std::set<KeyframeIndex> ends{0};
  for (const RobotId robot : peers) {
    const auto* edges = graph.newest_edges(robot);
    if (edges == nullptr) continue;
    for (const PoseEdge& e : *edges) ends.insert(e.end_on(self).index);
    const auto poses = published.find(robot);
    if (!plan.has_member(robot) && poses != published.end() && poses->second.frame == plan.frame)
      add_absent(poses->second, self, *edges, frozen);
  }
  for (const PoseEdge& e : frozen.between) ends.insert(e.end_on(self).index);
  frozen.datum_ties = datum_ties(plan, self);
  part.public_keyframes.assign(ends.begin(), ends.end());
  frozen.own = graph.own_edges();
  frozen.odometry = graph.keyframes() - 1;
  frozen.step_precision[self] = graph.mean_step_precision();
  frozen.upright = session.upright;
  frozen.origin = {plan.has_member(session.anchor) ? session.anchor : coordinator_of(plan), 0};
  if (session.upright) frozen.verticals = graph.verticals();
  return part;
}

}  // namespace km
