#include "apps/publish/pose_latency.hpp"

#include <algorithm>
#include <utility>

#include "modules/core/text_table.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "runtime/clock.hpp"

namespace km {
namespace {

constexpr double kSoon_s = 0.05;  // delay above which a pose counts as late

double quantile(std::vector<double> values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

}  // namespace

PoseLatency::PoseLatency(std::shared_ptr<const RosNetwork> network, const std::string& topic)
    : topic_(topic),
      subscription_(std::move(network),
                    {{topic, std::string(RosOdometry::kType), RosQos::kReliable, 1000}}),
      listener_([this] { listen(); }) {}

PoseLatency::~PoseLatency() {
  subscription_.stop();
}

void PoseLatency::sent(Stamp stamp) {
  const std::lock_guard lock(mutex_);
  sent_s_.emplace(stamp, steady_now_s());
  ++sent_;
}

void PoseLatency::listen() {
  while (const auto message = subscription_.next()) {
    const auto header = decode_ros<RosHeader>("cdr", message->bytes);
    const std::lock_guard lock(mutex_);
    const auto sent = header.value ? sent_s_.find(header.value->stamp) : sent_s_.end();
    if (sent == sent_s_.end()) continue;
    latencies_s_.push_back(steady_now_s() - sent->second);
    sent_s_.erase(sent);
  }
}

std::string PoseLatency::text() const {
  const std::lock_guard lock(mutex_);
  std::string text = topic_ + ": " + std::to_string(latencies_s_.size()) + " of " +
                     std::to_string(sent_) + " images have a pose";
  if (latencies_s_.empty()) return text;
  return text + ", after " + fixed(1e3 * quantile(latencies_s_, 0.5), 1) + " ms (median), " +
         fixed(1e3 * quantile(latencies_s_, 0.95), 1) + " ms (95 %), " +
         std::to_string(std::ranges::count_if(latencies_s_, [](double s) { return s > kSoon_s; })) +
         " of them after more than " + fixed(1e3 * kSoon_s, 0) + " ms";
}

}  // namespace km
