#include "modules/outlier_rejection/pcm_node.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueue = 256;

}  // namespace

PcmNode::PcmNode(const PcmConfig& config, RobotId self, Topic<Closure>& closures,
                 const Topic<InlierSet>& inlier_sets)
    : config_(checked(config)),
      self_(self),
      inlier_sets_(inlier_sets),
      worker_(
          kQueue, Overflow::kBlock,
          [this](const Input& closure) { closure ? step(*closure) : publish_changes(); },
          PcmConfig::kSection),
      ticks_(
          steady_duration(config.publish_period_s), [this] { worker_.post(nullptr); }, "pcm tick") {
  closures.subscribe([this](const auto& message) { worker_.post(message); });
}

void PcmNode::start() {
  worker_.start();
  ticks_.start();
}

void PcmNode::stop() noexcept {
  worker_.stop();  // refuses further ticks, so that none waits for room
  ticks_.stop();
  if (worker_.error() == nullptr) publish_changes();
}

std::exception_ptr PcmNode::error() const {
  return worker_.error() != nullptr ? worker_.error() : ticks_.error();
}

void PcmNode::step(const Closure& closure) {
  const RobotId from = closure.from.id.robot, to = closure.to.id.robot;
  if (std::min(from, to) != self_) return;
  if (!is_usable(closure)) {
    log::limited(log::Level::kWarn, name(), "unusable")
        << "closure " << to_string(closure.from.id) << " -> " << to_string(closure.to.id)
        << " cannot be weighed: refused";
    return;
  }
  const RobotId other = std::max(from, to);
  Pcm& pcm = pcm_of_.try_emplace(other, self_, other, config_).first->second;
  const PcmVerdict verdict = pcm.add(closure);
  if (verdict == PcmVerdict::kGrew) changed_.insert(other);
  report(closure, verdict, pcm);
}

void PcmNode::report(const Closure& closure, PcmVerdict verdict, const Pcm& pcm) const {
  const RobotId other = std::max(closure.from.id.robot, closure.to.id.robot);
  const std::string pair = "robots " + std::to_string(self_) + " " + std::to_string(other) + ": ";
  if (verdict == PcmVerdict::kFull)
    log::limited(log::Level::kWarn, name(), "full " + pair)
        << pair << Pcm::kMaxClosures << " closures are stored, more are refused";
  if (verdict == PcmVerdict::kAgainstOdometry)
    log::debug(name()) << pair << to_string(closure.from.id) << " -> " << to_string(closure.to.id)
                       << " disagrees with odometry";
  const MaxClique& clique = pcm.clique();
  if (config_.search == CliqueMethod::kExact && !clique.proven())
    log::limited(log::Level::kInfo, name(), "unproven " + pair)
        << pair << clique.clique().size() << " closures agree, up to " << clique.bound()
        << " may: a search ended at pcm.max_search_nodes and fell back to the heuristic";
}

void PcmNode::publish_changes() {
  for (const RobotId other : std::exchange(changed_, {})) {
    std::vector<ClosureId> inliers = pcm_of_.at(other).inliers();
    if (inliers.empty()) continue;
    log::debug(name()) << "robots " << self_ << ' ' << other << ": " << inliers.size() << " of "
                       << pcm_of_.at(other).size() << " closures agree";
    inlier_sets_.publish(InlierSet{self_, other, ++version_of_[other], std::move(inliers)});
  }
}

}  // namespace km
