#include "modules/outlier_rejection/node/pcm_node.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueue = 256;
constexpr double kPublishPeriod_s = 0.5;  // period at which changed sets are published

std::string text_of(RobotId a, RobotId b) {
  return "robots " + std::to_string(a) + ' ' + std::to_string(b) + ": ";
}

}  // namespace

PcmNode::PcmNode(const PcmConfig& config, RobotId self, const PcmTopics& topics,
                 std::uint32_t first_version)
    : WorkerNode({.name = PcmConfig::kSection, .queue = kQueue, .tick_s = kPublishPeriod_s}),
      config_(checked(config)),
      self_(self),
      first_version_(first_version),
      inlier_sets_(topics.inlier_sets) {
  follow(topics.closures, topics.keyframes, topics.restarts, topics.restored);
}

void PcmNode::handle(const Input& input) {
  if (const auto* closure = std::get_if<Topic<Closure>::Message>(&input)) return step(**closure);
  if (const auto* keyframe = std::get_if<Topic<KeyframeOdometry>::Message>(&input))
    return step(**keyframe);
  if (const auto* event = std::get_if<Topic<PeerEvent>::Message>(&input)) return step(**event);
  if (const auto* set = std::get_if<Topic<InlierSet>::Message>(&input)) return step(**set);
  publish_changes();
}

void PcmNode::step(const KeyframeOdometry& keyframe) {
  newest_ = std::max(newest_.value_or(keyframe.stamp), keyframe.stamp);
}

void PcmNode::step(const PeerEvent& event) {
  if (event.kind != PeerEventKind::kRestarted) return;
  pairs_.erase(event.identity.robot);
  no_more_ = false;
}

void PcmNode::step(const InlierSet& restored) {
  if (restored.a != self_) return;
  Pair& pair = pair_with(restored.b);
  pair.waited = pair.changed = true;
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
  Pair& pair = pair_with(std::max(from, to));
  if (!pair.since) pair.since = newest_;
  const PcmAddResult result =
      std::visit([&](auto& set) { return set.add(closure); }, pair.closures);
  const bool takes_all = config_.selection == ClosureSelection::kWitness;
  pair.changed |= result == PcmAddResult::kGrew || (takes_all && result == PcmAddResult::kAdded);
  const std::string robots = text_of(self_, std::max(from, to));
  if (result == PcmAddResult::kFull)
    log::limited(log::Level::kWarn, name(), "full " + robots)
        << robots << Pcm::kMaxClosures << " closures are stored, more are refused";
}

PcmNode::Pair& PcmNode::pair_with(RobotId other) {
  const auto found = pairs_.find(other);
  if (found != pairs_.end()) return found->second;
  Pair pair{WitnessedPair(self_, other, config_)};
  if (config_.selection == ClosureSelection::kPcm)
    pair.closures.emplace<Pcm>(self_, other, config_);
  return pairs_.emplace(other, std::move(pair)).first->second;
}

void PcmNode::publish_changes() {
  for (auto& [other, pair] : pairs_) {
    std::vector<ClosureId> closures = selected(other, pair);
    if (closures.empty()) continue;
    pair.changed = false;
    const auto version = version_of_.try_emplace(other, first_version_).first;
    inlier_sets_.publish(InlierSet{self_, other, ++version->second, std::move(closures)});
  }
}

std::vector<ClosureId> PcmNode::selected(RobotId other, Pair& pair) const {
  if (!pair.changed) return {};
  if (const auto* pcm = std::get_if<Pcm>(&pair.closures)) {
    std::vector<ClosureId> inliers = pcm->inliers();
    pair.changed = false;
    log::debug(name()) << text_of(self_, other) << inliers.size() << " of " << pcm->size()
                       << " closures agree";
    return inliers;
  }
  if (!is_joined(other, pair)) return {};
  return std::get<WitnessedPair>(pair.closures).closures();
}

bool PcmNode::is_joined(RobotId other, Pair& pair) const {
  const auto& closures = std::get<WitnessedPair>(pair.closures);
  if (other == self_ || pair.waited || closures.is_witnessed()) return true;
  if (!pair.since) pair.since = newest_;
  const double waited_s = pair.since ? seconds_between(*pair.since, *newest_) : 0.0;
  if (!no_more_ && waited_s < config_.witness_wait_s) return false;
  if (!closures.is_strong()) {
    log::limited(log::Level::kWarn, name(), "weak " + text_of(self_, other))
        << text_of(self_, other) << "not joined: at their best place closures have "
        << closures.support() << " inliers of pcm.min_lone_support " << config_.min_lone_support
        << ", and none at another place agrees";
    return false;
  }
  pair.waited = true;
  const std::size_t places = closures.witnesses();
  log::info(name()) << text_of(self_, other) << "joined by "
                    << (places == 1 ? std::string("one place") : std::to_string(places) + " places")
                    << " only, no other place has agreed within " << waited_s
                    << " s of keyframes: the join is tentative";
  return true;
}

}  // namespace km
