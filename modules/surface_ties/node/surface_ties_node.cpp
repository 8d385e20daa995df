#include "modules/surface_ties/node/surface_ties_node.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueue = 4096;
constexpr double kTick_s = 0.1;

// Pause after a registration, as a multiple of the time that it takes.
constexpr double kPauses = 10.0;

std::string text_of(const Closure& tie) {
  const double sigma_m = std::sqrt(tie.covariance.bottomRightCorner<3, 3>().trace() / 3.0);
  return to_string(tie.from.id) + " and " + to_string(tie.to.id) + " by " +
         std::to_string(tie.inliers) + " independent samples, standard deviation " +
         std::to_string(std::lround(1e3 * sigma_m)) + " mm";
}

}  // namespace

SurfaceTiesNode::SurfaceTiesNode(RobotId self, KeyframeIndex max_gap_keyframes,
                                 const SurfaceTiesTopics& topics)
    : self_(self),
      ties_(topics.ties),
      outcomes_(topics.outcomes),
      search_(self, max_gap_keyframes),
      worker_(
          kQueue, Overflow::kBlock, [this](const Input& input) { step(input, steady_now_s()); },
          "surface_ties"),
      ticks_(
          steady_duration(kTick_s), [this] { worker_.post(Tick()); }, "ties tick") {
  for (const In<MeshChunk>& chunks : {topics.own_chunks, topics.peer_chunks})
    chunks.subscribe([this](const auto& chunk) { post(chunk); });
  for (const In<MeshPoses>& poses : {topics.own_poses, topics.peer_poses})
    poses.subscribe([this](const auto& newest) { post(newest); });
  topics.closures.subscribe([this](const auto& closure) { post(closure); });
  topics.progress.subscribe([this](const auto& progress) { post(progress); });
  topics.restarts.subscribe([this](const auto& event) { post(event); });
}

void SurfaceTiesNode::start() {
  worker_.start();
  ticks_.start();
}

void SurfaceTiesNode::stop() noexcept {
  worker_.stop();
  ticks_.stop();
}

std::exception_ptr SurfaceTiesNode::error() const {
  return worker_.error() != nullptr ? worker_.error() : ticks_.error();
}

void SurfaceTiesNode::post(Input input) {
  ++arrived_;
  worker_.post(std::move(input));
}

void SurfaceTiesNode::step(const Input& input, double now_s) {
  if (std::holds_alternative<Tick>(input)) return search(now_s);
  if (const auto* keyframe = std::get_if<OdometryPose>(&input))
    search_.learn(*keyframe);
  else if (const auto* chunk = std::get_if<Topic<MeshChunk>::Message>(&input))
    search_.add(**chunk, now_s);
  else if (const auto* poses = std::get_if<Topic<MeshPoses>::Message>(&input))
    search_.add(**poses, now_s);
  else if (const auto* closure = std::get_if<Topic<Closure>::Message>(&input))
    search_.add((*closure)->id());
  else if (const auto* progress = std::get_if<Topic<OptimizerProgress>::Message>(&input))
    take(**progress);
  else if (const auto& event = std::get<Topic<PeerEvent>::Message>(input);
           event->kind == PeerEventKind::kRestarted)
    search_.forget(event->identity.robot);
  // A tick searches again.
  search_done_ = search_.is_done();
  ++handled_;
}

void SurfaceTiesNode::take(const OptimizerProgress& progress) {
  std::vector<RobotId> joined = progress.members;
  // Without a place among the earlier runs, the pose relative to their keyframes is unknown.
  std::erase_if(joined, [&](RobotId robot) {
    if (robot == self_) return !progress.located;
    return std::ranges::binary_search(progress.tentative, robot) ||
           std::ranges::binary_search(progress.not_joined, robot);
  });
  search_.set_joined(std::move(joined));
}

void SurfaceTiesNode::search(double now_s) {
  if (now_s < next_s_) return;
  const double start_s = steady_now_s();
  const std::optional<Closure> tie = search_.step(now_s);
  next_s_ = now_s + kPauses * (steady_now_s() - start_s);
  if (tie) {
    log::info(name()) << "ties " << text_of(*tie);
    outcomes_.publish(ClosureOutcome{.id = tie->id(),
                                     .similarity = 0.0,
                                     .stage = ClosureStage::kVerified,
                                     .reason = {},
                                     .matches = tie->inliers,
                                     .inliers = tie->inliers});
    ties_.publish(*tie);
  }
  search_done_ = search_.is_done();
}

}  // namespace km
