#include "apps/robot/assemblies/back_end.hpp"

#include <optional>

#include "modules/loop_closure/node/loop_closure_codec.hpp"
#include "modules/outlier_rejection/node/outlier_rejection_codec.hpp"
#include "modules/place_recognition/node/place_recognition_codec.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "modules/session/node/team_codec.hpp"
#include "modules/session/node/team_node.hpp"

namespace km {
namespace {

std::optional<KeyframeId> keyframe_of(const KeyframeReply& reply) {
  return reply.found ? std::optional(reply.keyframe.odometry.id) : std::nullopt;
}

}  // namespace

BackEnd::BackEnd(RobotCore& core, const RobotConfig& config, int dimension, std::uint64_t map)
    : core_(core) {
  if (core_.past.run)
    for (const auto& [robot, peer] : core_.past.run->peers) {
      core_.bridge->peers().tell(&PeerTable::recall,
                                 {.robot = robot, .name = peer.name, .boot = peer.boot});
      incarnations_.meet({robot, peer.boot});
    }
  add_solver(config, dimension, map);
  add_overlay();
  add_crossings();
  address_closures();
}

void BackEnd::add_solver(const RobotConfig& config, int dimension, std::uint64_t map) {
  Topics& t = core_.topics;
  forward<Closure>(t.own_closures, t.closures);
  forward<Closure>(t.shared_closures.received, t.closures);
  pcm_ = &core_.nodes.add<PcmNode>(config.pcm, core_.identity.robot,
                                   PcmTopics{.closures = t.closures,
                                             .keyframes = t.keyframe_odometry,
                                             .restarts = t.closure_restarts,
                                             .restored = t.restored_inlier_sets,
                                             .inlier_sets = t.own_inlier_sets},
                                   resume_count(core_.identity.boot) << kResumeBits);
  auto& team = core_.nodes.add<TeamNode>(
      config.pose_graph, TeamPeer{core_.identity.robot, core_.identity.boot},
      solver_choice(config.pose_graph, dimension), [this] { return overlay_->session_bytes(); },
      TeamTopics{.odometry = t.keyframe_odometry,
                 .closures = t.closures,
                 .fixes = t.fixes,
                 .inlier_sets = t.own_inlier_sets,
                 .peer_inlier_sets = t.shared_inlier_sets.received,
                 .restored_inlier_sets = t.restored_inlier_sets,
                 .peer_events = core_.bridge->peers().events(),
                 .restarts = t.closure_restarts,
                 .links = t.links,
                 .peer_messages = t.peer_team_messages,
                 .messages = t.team_messages,
                 .trajectory = t.trajectory,
                 .progress = t.progress,
                 .verdicts = t.closure_verdicts},
      dimension);
  team.begin_in_map(map);
  if (core_.past.has_solution()) team.restore(core_.past.run->solution);
}

void BackEnd::add_overlay() {
  Topics& t = core_.topics;
  const In<PeerEvent> peer_events = core_.bridge->peers().events();
  forward<PeerEvent>(peer_events, t.ways);
  overlay_ = &core_.nodes.add<OverlayNode>(
      TeamPeer{core_.identity.robot, core_.identity.boot}, core_.seal.get(), core_.bridge->peers(),
      OverlayTopics{.peer_events = peer_events,
                    .statuses = t.status.from_peers(),
                    .team_packets = t.team_packets.to_peers(),
                    .places_packets = t.places_packets.to_peers(),
                    .reached = t.ways,
                    .links = t.links,
                    .renew = [this](RobotId robot) { core_.bridge->renew(robot); }});
  join_team(*overlay_, t.team_messages, t.peer_team_messages);
  overlay_->join<KeyframeBow>(OverlayStream::kBag, t.bows.from_peers(), t.peer_bows);
  overlay_->join_calls(
      OverlayStream::kRequest, t.requests.ends(),
      [](const KeyframeRequest& request) { return std::optional(request.keyframe); });
  overlay_->join_calls(OverlayStream::kReply, t.replies.ends(), keyframe_of);
  overlay_->join_calls(OverlayStream::kWords, t.words.ends(),
                       [](const KeyframeWords& words) { return std::optional(words.keyframe); });
  overlay_->join_reliable(OverlayStream::kClosure, t.shared_closures.ends());
  overlay_->join_reliable(OverlayStream::kInlierSet, t.shared_inlier_sets.ends());
}

// All crossings between robots but those of the map, with their kind and the category under which
// their bytes are counted.
void BackEnd::add_crossings() {
  using enum TopicKind;
  using enum TrafficCategory;
  DdsBridge& dds = *core_.bridge;
  Topics& t = core_.topics;
  dds.exchange(t.bows, kEvent, kPlaceRecognition, {}, {},
               overlay_->guard<KeyframeBow>(OverlayStream::kBag, [](const KeyframeBow& bow) {
                 return std::optional(bow.id);
               }));
  // The reply to a request of 60 bytes has up to 4 kB.
  dds.exchange(t.requests.direct, kRequest, kGeometricVerification, {},
               {.per_second = 30, .burst = 60});
  dds.exchange(t.replies.direct, kRequest, kGeometricVerification, {}, {},
               overlay_->guard<KeyframeReply>(OverlayStream::kReply, keyframe_of));
  dds.exchange(t.words.direct, kRequest, kGeometricVerification);
  dds.exchange(t.shared_closures.direct, kEvent, kGeometricVerification);
  dds.exchange(t.shared_inlier_sets.direct, kState, kPoseGraphOptimization);
  dds.exchange(t.team_packets, kRequest, kPoseGraphOptimization, {}, {},
               overlay_->guard_packets<OverlayLane::kTeam>());
  dds.exchange(t.places_packets, kRequest, kOther, {}, {},
               overlay_->guard_packets<OverlayLane::kPlaces>());
  dds.exchange(t.status, kStatus, kOther);
}

// Closures and inlier sets are sent only to the robots that they connect.
void BackEnd::address_closures() {
  Topics& t = core_.topics;
  t.own_closures.subscribe(
      [this, to = Out<Addressed<Closure>>(t.shared_closures.own)](const auto& closure) {
        const RobotId other = closure->to.id.robot;
        if (other != closure->from.id.robot)
          to.publish(Addressed<Closure>{other, closure, incarnations_.of(other)});
      });
  const auto meet = [this](const auto& event) {
    incarnations_.meet({event->identity.robot, event->identity.boot});
  };
  t.closure_restarts.subscribe(meet);
  t.own_inlier_sets.subscribe(
      [this, to = Out<Addressed<InlierSet>>(t.shared_inlier_sets.own)](const auto& set) {
        if (set->a != set->b)
          to.publish(Addressed<InlierSet>{set->b, set, incarnations_.of(set->b)});
      });
  core_.bridge->peers().events().subscribe([this, meet](const auto& event) {
    if (event->kind == PeerEventKind::kJoined || event->kind == PeerEventKind::kReported)
      meet(event);
    if (event->kind == PeerEventKind::kConflict && event->identity.robot == core_.identity.robot)
      id_taken_ = true;
  });
}

}  // namespace km
