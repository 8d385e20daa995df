#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/robust/closure_places.hpp"
#include "modules/session/agent_state.hpp"
#include "modules/tree_newton/vertical_prior.hpp"

// Frames, and the messages to the own robot.

namespace km {
namespace {

// True if kept closures at two places tie the last run to keyframes before it, or if there is only
// one run.
bool is_tied_to_earlier_runs(const AgentState& s) {
  if (s.graph.later_runs().empty()) return true;
  constexpr std::size_t kLeastPlaces = 2;  // one place may be mistaken for another
  std::vector<PoseEdge> across =
      s.graph.closures_across(s.graph.later_runs().back(), s.graph.keyframes());
  std::erase_if(across, [&](const PoseEdge& e) {
    const auto decided = s.decisions.decided().find(e.id());
    return decided == s.decisions.decided().end() || !decided->second;
  });
  // Places of the present run: a short run before it may have a single place.
  for (PoseEdge& e : across) (e.from.index < e.to.index ? e.from : e.to).index = 0;
  return find_places(across).sizes.size() >= kLeastPlaces;
}

// This robot if it is located in a datum. Otherwise the lowest robot with this property that
// closures tie to it.
std::optional<RobotId> robot_in_datum(const AgentState& s) {
  if (datum_of(s, s.self.robot) != 0) return s.self.robot;
  std::optional<RobotId> lowest;
  for (const SessionMember& member : s.plan.members) {
    const RobotId robot = member.peer.robot;
    if (datum_of(s, robot) != 0 && !std::ranges::binary_search(s.ties.not_joined, robot))
      lowest = std::min(lowest.value_or(robot), robot);
  }
  return lowest;
}

// The frame of the datum. Its name is the lowest known robot in the datum, tied to this robot or
// not.
std::optional<World> world_of_datum(const AgentState& s) {
  const auto located = robot_in_datum(s);
  auto world = located ? world_of(s, *located) : std::nullopt;
  if (!world) return std::nullopt;
  const std::uint64_t datum = datum_of(s, *located);
  for (const auto& [robot, peer] : s.roster.peers())
    if (datum_of(s, robot) == datum) world->anchor = std::min(world->anchor, robot);
  return world;
}

bool is_located(const AgentState& s) {
  return robot_in_datum(s) || is_tied_to_earlier_runs(s);
}

std::optional<FixesState> fixes_state(const AgentState& s) {
  if (s.graph.fixes().empty()) return std::nullopt;
  FixesState state = s.placement.state;
  double sum = 0.0;
  for (std::size_t k = 0; k < s.placement.kept.size(); ++k) {
    const PositionFix& fix = s.graph.fixes()[k];
    if (s.placement.kept[k])
      sum += (s.poses.T_frame_kf()[fix.keyframe.index] * fix.p_kf -
              s.poses.T_frame_kf().front() * fix.p_datum)
                 .squaredNorm();
  }
  if (state.used > 0) state.residual_m = std::sqrt(sum / state.used);
  return state;
}

// Public poses of the other robots in the frame of this one.
std::map<KeyframeId, SE3> held_poses(const AgentState& s, const SE3& T_world_frame) {
  std::map<KeyframeId, SE3> held;
  for (const auto& [robot, poses] : s.roster.results())
    for (std::size_t k = 0; k < poses.keyframes.size(); ++k)
      if (robot != s.self.robot && poses.frame == s.frame)
        held[{robot, poses.keyframes[k]}] = T_world_frame * poses.T_frame_kf[k].pose();
  return held;
}

bool holds_all(const AgentState& s, const SessionPlan& plan) {
  const auto self =
      std::find_if(plan.members.begin(), plan.members.end(),
                   [&](const SessionMember& member) { return member.peer == s.self; });
  if (self->revision != s.graph.revision() || self->datum != datum_of(s, s.self.robot))
    return false;
  std::optional<RobotId> last;
  for (const EdgeSetOffer& offer : s.graph.offers()) {
    const bool newest = offer.peer != last;
    last = offer.peer;
    const TeamRoster::Peer* peer = s.roster.find(offer.peer);
    if (!newest || peer == nullptr || peer->other_method ||
        !s.roster.in_reach({offer.peer, peer->boot}))
      continue;
    const SessionPair pair{std::min(s.self.robot, offer.peer), std::max(s.self.robot, offer.peer),
                           offer.id};
    if (std::find(plan.pairs.begin(), plan.pairs.end(), pair) == plan.pairs.end()) return false;
  }
  return true;
}

}  // namespace

std::uint64_t own_datum(const AgentState& s) {
  return s.graph.fixes().empty() ? s.map_id : s.graph.fixes().back().datum;
}

std::uint64_t datum_of(const AgentState& s, RobotId robot) {
  if (robot == s.self.robot) {
    const std::uint64_t own = own_datum(s);
    const bool located = own != 0 && (s.graph.fixes().empty() ? is_tied_to_earlier_runs(s)
                                                              : s.placement.state.located);
    return located ? own : 0;
  }
  const TeamRoster::Peer* peer = s.roster.find(robot);
  return peer != nullptr && peer->status ? peer->status->datum : 0;
}

// If the solution is upright, `world` is rotated so that z is up, because the optimum has a better
// estimate of the tilt of keyframe 0 than its own vertical.
std::optional<World> world_of(const AgentState& s, RobotId anchor) {
  const auto poses = s.roster.results().find(anchor);
  if (poses == s.roster.results().end() || poses->second.frame != s.frame) return std::nullopt;
  const TeamRoster::Peer* peer = s.roster.find(anchor);
  const bool own = anchor == s.self.robot;
  if (!own && (peer == nullptr || !peer->status)) return std::nullopt;
  const SE3& T_odom_kf = own ? s.graph.T_odom_first() : peer->status->T_odom_first;
  const SE3 T_frame_world = poses->second.T_frame_kf.front().pose() * T_odom_kf.inverse();
  if (!s.part || !s.part->session().upright) return World{anchor, T_frame_world};
  const Eigen::MatrixXd turned =
      level(T_frame_world.matrix().topRows<3>(), T_odom_kf.translation());
  return World{anchor, make_pose(turned.leftCols<3>(), turned.col(3))};
}

std::optional<World> tied_world(const AgentState& s) {
  const std::optional<World>& world = s.world;
  if (auto of_datum = world ? world_of_datum(s) : std::nullopt) return of_datum;
  if (!world || !std::ranges::binary_search(s.ties.not_joined, world->anchor)) return world;
  return world_of(s, lowest_tied(s.self.robot, s.plan, s.ties));
}

// That of the last session until the present one has evaluated its own.
Objective objective(const AgentState& s) {
  if (!s.part) return s.objective_before;
  const Session& session = s.part->session();
  if (session.finished) return {session.cost, session.gradient};
  const auto& state = s.part->progress();
  return state.cost > 0.0 ? Objective{state.cost, state.gradient} : s.objective_before;
}

OptimizerProgress make_progress(const AgentState& s) {
  const auto world = tied_world(s);
  OptimizerProgress progress{.anchor = world ? world->anchor : s.self.robot,
                             .members = {s.self.robot}};
  progress.located = is_located(s);
  progress.odometry_rotation_noise = s.graph.odometry_noise().rotation;
  progress.odometry_translation_noise = s.graph.odometry_noise().translation;
  progress.fixes = fixes_state(s);
  progress.odometry_breaks = static_cast<std::uint32_t>(s.graph.odometry_breaks().size());
  progress.round = s.rounds_before;
  const Objective present = objective(s);
  progress.cost = present.cost;
  progress.gradient_norm = present.gradient;
  progress.seconds = s.optimising_s;
  if (!s.part) return progress;
  const Session& session = s.part->session();
  if (s.in_session() || s.is_solved()) {
    progress.members.clear();
    for (const SessionMember& member : session.plan.members)
      if (s.roster.in_reach(member.peer)) progress.members.push_back(member.peer.robot);
    std::ranges::sort(progress.members);
    progress.tentative = s.ties.tentative;
    progress.not_joined = s.ties.not_joined;
  }
  progress.round += s.part->progress().round;
  progress.odometry_rotation_noise *= s.part->progress().odometry_noise;
  progress.odometry_translation_noise *= s.part->progress().odometry_noise;
  progress.seconds += s.part->cost().last_activity_s - s.part->cost().started_s;
  progress.settled =
      !s.in_session() && session.finished && !s.publish_due && holds_all(s, session.plan);
  return progress;
}

void publish(AgentState& s, TeamOutput& output) {
  const auto world = s.world ? tied_world(s) : std::nullopt;
  if (!world || (!s.publish_due && s.published_anchor == world->anchor)) return;
  s.publish_due = false;
  s.published_anchor = world->anchor;
  output.progress = make_progress(s);
  if (!output.progress->located) return;
  Trajectory trajectory{s.self.robot, world->anchor, {}};
  const SE3 T_world_frame = world->T_frame_world.inverse();
  for (const SE3& T_frame_kf : s.poses.T_frame_kf())
    trajectory.T_world_kf.push_back(T_world_frame * T_frame_kf);
  if (s.solution_anchor == world->anchor) trajectory.covariances = s.poses.covariances();
  trajectory.scale_sigma = robot_in_datum(s) ? 0.0 : s.config.scale_sigma;
  trajectory.public_poses = held_poses(s, T_world_frame);
  output.trajectory = std::move(trajectory);
}

}  // namespace km
