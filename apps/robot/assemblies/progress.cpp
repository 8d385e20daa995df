#include "apps/robot/assemblies/progress.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/core/io/text_table.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {

Progress::Progress(RobotCore& core, const Places& places)
    : core_(core), locator_(places.locator()) {
  Topics& t = core_.topics;
  t.packets.subscribe([this](const auto& packet) { reach(packet->frame->stamp); });
  t.progress.subscribe([this](const auto& progress) { take(progress); });
  t.status.from_peers().subscribe([this](const auto& status) {
    const std::lock_guard lock(mutex_);
    received_s_[status->robot] = steady_now_s();
  });
  t.keyframe_odometry.subscribe([this](const auto& keyframe) {
    // Keyframe 0 of a map or of fixes has no time of this run, also after --resume.
    const bool is_of_map = locator_ != nullptr && keyframe->id.index == 0 && keyframe->stamp == 0;
    // A pose graph and a former process have no packets.
    if (!is_of_map) reach(keyframe->stamp);
    ++keyframes_;
  });
}

void Progress::reach(Stamp stamp) {
  const std::lock_guard lock(mutex_);
  last_ = first_ ? std::max(last_, stamp) : stamp;
  if (!first_) first_ = stamp;
}

void Progress::take(const Topic<OptimizerProgress>::Message& progress) {
  const std::lock_guard lock(mutex_);
  optimizer_ = progress;
  const bool was_apart = std::exchange(is_apart_, !progress->located);
  if (is_apart_ || !was_apart || located_after_s_ || locator_ == nullptr) return;
  located_after_s_ = seconds_between(first_.value_or(last_), last_);
  log::info(locator_->name()) << "located after " << fixed(*located_after_s_, 1) << " s";
}

RobotStatus Progress::status(const OverlaySummary& overlay) const {
  const RobotIdentity& self = core_.identity;
  return {self.robot, self.name,      core_.phase, input_s(),
          keyframes_, settled_links_, self.boot,   overlay};
}

void Progress::add_to(RobotSample& sample) const {
  sample.name = core_.identity.name;
  sample.phase = to_string(core_.phase.load());
  sample.dataset_time_s = input_s();
  sample.keyframes = keyframes_;
  sample.anchor = core_.identity.robot;
  const auto finite = [](double value) { return std::isfinite(value) ? value : 0.0; };
  const double now_s = steady_now_s();
  const std::lock_guard lock(mutex_);
  for (const auto& [robot, received_s] : received_s_)
    sample.links.push_back({robot, static_cast<float>(std::max(0.0, now_s - received_s))});
  if (optimizer_ == nullptr) return;
  sample.anchor = optimizer_->anchor;
  sample.tentative = std::ranges::binary_search(optimizer_->tentative, optimizer_->anchor);
  sample.round = optimizer_->round;
  sample.cost = finite(optimizer_->cost);
  sample.gradient_norm = finite(optimizer_->gradient_norm);
}

}  // namespace km
