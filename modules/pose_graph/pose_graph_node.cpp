#include "modules/pose_graph/pose_graph_node.hpp"

#include <chrono>
#include <string>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueue = 1024;
constexpr std::chrono::milliseconds kTick{50};

template <typename... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <typename... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;  // Clang before 17 does not deduce aggregates

}  // namespace

PoseGraphNode::PoseGraphNode(const PoseGraphConfig& config, PgoPeer self,
                             const PoseGraphTopics& topics)
    : topics_(topics),
      method_(config.method),
      agent_(config, self),
      worker_(
          kQueue, Overflow::kBlock, [this](const Input& input) { step(input, steady_now_s()); },
          PoseGraphConfig::kSection),
      ticks_(
          kTick, [this] { worker_.post(Tick()); }, "pose_graph tick") {
  const auto post = [this](const auto& message) { worker_.post(message); };
  topics.odometry.subscribe(post);
  topics.closures.subscribe(post);
  topics.inlier_sets.subscribe(post);
  topics.peer_inlier_sets.subscribe(post);
  topics.peer_events.subscribe(post);
  topics.peer_status.subscribe(post);
  topics.peer_sessions.subscribe(post);
  topics.peer_poses.subscribe(post);
  topics.peer_exchanges.subscribe(post);
}

void PoseGraphNode::start() {
  worker_.start();
  ticks_.start();
}

void PoseGraphNode::stop() noexcept {
  worker_.stop();  // refuses further ticks, so that none waits for room
  ticks_.stop();
}

std::exception_ptr PoseGraphNode::error() const {
  return worker_.error() != nullptr ? worker_.error() : ticks_.error();
}

void PoseGraphNode::step(const Input& input, double now_s) {
  take(input);
  const bool is_tick = std::holds_alternative<Tick>(input);
  for (bool more = is_tick || worker_.load().size == 0; more;) {
    PgoOutput output = agent_.step(now_s);
    more = output.more && worker_.load().size == 0;
    publish(std::move(output));
  }
}

void PoseGraphNode::take(const Input& input) {
  const auto take_in = Overloaded{
      [](const Tick&) {},
      [&](const Topic<KeyframeOdometry>::Message& m) { (void)agent_.add(*m); },
      [&](const Topic<Closure>::Message& m) { (void)agent_.add(*m); },
      [&](const Topic<InlierSet>::Message& m) { (void)agent_.add(*m); },
      [&](const Topic<PeerEvent>::Message& m) { take_peer_event(*m); },
      [&](const Topic<PgoStatus>::Message& m) { take_status(*m); },
      [&](const Topic<PgoSession>::Message& m) {
        if (!agent_.receive(*m)) refuse("session", m->id.coordinator.robot);
      },
      [&](const Topic<PublicPoses>::Message& m) {
        if (!agent_.receive(*m)) refuse("poses", m->sender.robot);
      },
      [&](const Topic<SolverMessage>::Message& m) {
        if (!agent_.receive(m)) refuse("exchange", m->sender.robot);
      },
  };
  std::visit(take_in, input);
}

void PoseGraphNode::take_peer_event(const PeerEvent& event) {
  switch (event.kind) {
    case PeerEventKind::kJoined:
    case PeerEventKind::kReturned:
    case PeerEventKind::kRestarted:
      return agent_.peer_alive({event.identity.robot, event.identity.boot});
    case PeerEventKind::kLost:
    case PeerEventKind::kLeft:
      return agent_.peer_lost(event.identity.robot);
    case PeerEventKind::kRefused:
    case PeerEventKind::kConflict:
      return;
  }
}

void PoseGraphNode::take_status(const PgoStatus& status) {
  if (agent_.receive(status)) return;
  if (status.method == method_) return refuse("status", status.sender.robot);
  log::limited(log::Level::kWarn, name(), "method" + std::to_string(status.sender.robot))
      << "robot " << status.sender.robot << " optimises by '" << to_string(status.method)
      << "', this one by '" << to_string(method_)
      << "': not together, until pose_graph.method is the same";
}

void PoseGraphNode::refuse(const char* kind, RobotId from) const {
  log::limited(log::Level::kWarn, name(), kind + std::to_string(from))
      << kind << " of robot " << from << " refused: of a former process of it, or not usable";
}

void PoseGraphNode::publish(PgoOutput output) const {
  if (output.session) topics_.sessions.publish(std::move(*output.session));
  if (output.poses) topics_.poses.publish(std::move(*output.poses));
  for (const SolverMessagePtr& message : output.exchange) topics_.exchanges.publish(message);
  if (output.notice) log::limited(log::Level::kWarn, name(), "notice") << *output.notice;
  if (output.status) topics_.status.publish(std::move(*output.status));
  if (output.trajectory) topics_.trajectory.publish(std::move(*output.trajectory));
  if (output.progress) topics_.progress.publish(std::move(*output.progress));
  if (output.verdicts) publish(std::move(*output.verdicts));
}

void PoseGraphNode::publish(ClosureVerdicts verdicts) const {
  if (const std::size_t rejected = verdicts.rejected(); rejected > 0)
    log::limited(log::Level::kInfo, name(), "verdicts")
        << rejected << " of this robot's " << verdicts.closures.size()
        << " closures rejected by graduated non-convexity";
  topics_.verdicts.publish(std::move(verdicts));
}

}  // namespace km
