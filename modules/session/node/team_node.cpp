#include "modules/session/node/team_node.hpp"

#include <utility>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueue = 1024;
constexpr double kTick_s = 0.05;

template <typename... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <typename... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;  // Clang before 17 does not deduce aggregates

}  // namespace

TeamNode::TeamNode(const PoseGraphConfig& config, TeamPeer self, MemberSolverFactory solvers,
                   std::function<std::uint64_t()> sent_bytes, const TeamTopics& topics,
                   int dimension)
    : WorkerNode({.name = PoseGraphConfig::kSection, .queue = kQueue, .tick_s = kTick_s}),
      self_(self),
      topics_(topics),
      sent_bytes_(std::move(sent_bytes)),
      agent_(config, self, std::move(solvers), dimension) {
  follow(topics.odometry, topics.closures, topics.fixes, topics.inlier_sets,
         topics.peer_inlier_sets, topics.restored_inlier_sets, topics.peer_events, topics.links,
         topics.peer_messages);
  topics.restarts.subscribe([this](const auto& event) {
    post(NewIncarnation{{event->identity.robot, event->identity.boot}});
  });
}

void TeamNode::step(const Input& input, double now_s) {
  take(input);
  const bool is_tick = std::holds_alternative<Tick>(input);
  for (bool more = is_tick || load().size == 0; more;) {
    TeamOutput output = agent_.step(now_s, sent_bytes_());
    more = output.more && load().size == 0;
    publish(std::move(output));
  }
}

// Ignores refusals: a refused input is already known, or the agent counts it and gives notice.
void TeamNode::take(const Input& input) {
  const auto take_in = Overloaded{
      [](const Tick&) {},
      [&](const NewIncarnation& incarnation) { agent_.peer_restarted(incarnation.peer); },
      [&](const Topic<PeerEvent>::Message& m) { take_peer_event(*m); },
      [&](const Topic<LinksReport>::Message& m) { agent_.update_links(*m); },
      [&](const Topic<TeamMessage>::Message& m) { (void)agent_.receive(*m); },
      [&](const auto& measured) { agent_.add(*measured); },
  };
  std::visit(take_in, input);
}

void TeamNode::take_peer_event(const PeerEvent& event) {
  if (!event.direct) return;
  switch (event.kind) {
    case PeerEventKind::kJoined:
    case PeerEventKind::kReturned:
    case PeerEventKind::kResumed:
    case PeerEventKind::kRestarted:
      return agent_.peer_alive({event.identity.robot, event.identity.boot});
    case PeerEventKind::kLost:
    case PeerEventKind::kLeft:
      return agent_.peer_lost(event.identity.robot);
    case PeerEventKind::kRefused:
    case PeerEventKind::kConflict:
    case PeerEventKind::kReported:
      return;
  }
}

void TeamNode::publish(TeamOutput output) {
  for (TeamMessage& message : output.messages) topics_.messages.publish(std::move(message));
  for (const std::string& notice : output.notices)
    log::limited(log::Level::kWarn, name(), notice) << notice;
  for (const std::string& news : output.news) log::limited(log::Level::kInfo, name(), news) << news;
  if (output.trajectory) topics_.trajectory.publish(std::move(*output.trajectory));
  if (output.progress) topics_.progress.publish(std::move(*output.progress));
  if (!output.verdicts) return;
  const std::size_t rejected = output.verdicts->rejected();
  if (std::exchange(rejected_, rejected) != rejected && rejected > 0)
    log::limited(log::Level::kInfo, name(), "verdicts")
        << rejected << " of this robot's " << output.verdicts->closures.size()
        << " closures rejected: other measurements contradict them";
  topics_.verdicts.publish(std::move(*output.verdicts));
}

}  // namespace km
