#include "modules/absolute_fixes/node/fixes_node.hpp"

#include <utility>

namespace km {
namespace {

constexpr std::size_t kQueue = 4096;  // minutes of images

}  // namespace

FixesNode::FixesNode(FixInput input, const FixesTopics& topics)
    : WorkerNode({.name = AbsoluteFixesConfig::kSection, .queue = kQueue}),
      reader_(std::move(input.reader)),
      association_(Eigen::Vector3d(reader_.config().lever_arm_m.data()),
                   reader_.config().used_correlation_s(), input.recorded),
      live_(std::move(input.live)),
      topics_(topics) {
  follow(topics.states, topics.restored_states, topics.keyframes);
}

void FixesNode::start_sources() {
  if (live_ != nullptr) receiver_.start("fixes_live", [this] { receive(); });
}

void FixesNode::stop_sources() noexcept {
  if (live_ != nullptr) live_->stop();
  receiver_.join();
}

void FixesNode::receive() {
  while (auto message = live_->next())
    post(std::make_shared<const BagMessage>(*std::move(message)));
}

void FixesNode::step(const Input& input) {
  std::vector<PositionFix> fixes;
  std::optional<ReceivedFix> received;
  {
    const std::lock_guard lock(mutex_);
    if (const auto* state = std::get_if<Topic<OdometryState>::Message>(&input)) {
      association_.add(**state);
    } else if (const auto* keyframe = std::get_if<Topic<KeyframeOdometry>::Message>(&input)) {
      if ((*keyframe)->id.index > 0) association_.add(**keyframe);
    } else {
      const BagMessage& message = *std::get<std::shared_ptr<const BagMessage>>(input);
      received = reader_.decode(live_->channels()[message.channel], message);
      const auto fix = received ? reader_.accept(*received) : std::nullopt;
      if (fix)
        association_.add(*fix);
      else
        received.reset();
    }
    fixes = association_.take(reader_.datum_id());
  }
  if (received) topics_.received(*received);
  for (PositionFix& fix : fixes) topics_.fixes.publish(std::move(fix));
}

FixCounts FixesNode::counts() const {
  const std::lock_guard lock(mutex_);
  FixCounts counts = reader_.counts();
  counts.far_from_keyframe = association_.unused();
  return counts;
}

std::optional<GeodeticPoint> FixesNode::datum() const {
  const std::lock_guard lock(mutex_);
  return reader_.datum();
}

}  // namespace km
