#include "runtime/ros/ros_subscription.hpp"

#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <span>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/heartbeat.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

Stamp wall_now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

RosSubscription::RosSubscription(std::shared_ptr<const RosNetwork> network,
                                 std::vector<RosTopic> topics)
    : network_(std::move(network)),
      topics_(std::move(topics)),
      discovery_(*network_),
      waitset_(dds_create_waitset(network_->participant()), "waitset"),
      guard_(dds_create_guardcondition(network_->participant()), "guard condition") {
  check_dds(dds_waitset_attach(waitset_.handle(), guard_.handle(), -1), "cannot wait for a stop");
  for (const RosTopic& wanted : topics_) {
    dds_topics_.push_back(network_->create_topic(wanted.topic, wanted.type));
    const DdsQos qos = ros_qos(wanted.qos, wanted.depth);
    readers_.emplace_back(
        dds_create_reader(network_->participant(), dds_topics_.back().handle(), qos.get(), nullptr),
        "reader of " + wanted.topic);
    const dds_entity_t reader = readers_.back().handle();
    check_dds(dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS), "cannot wait for data");
    check_dds(dds_waitset_attach(waitset_.handle(), reader,
                                 static_cast<dds_attach_t>(readers_.size() - 1)),
              "cannot wait for " + wanted.topic);
  }
}

// Messages lost before the first next() do not count.
void RosSubscription::begin() {
  silence_checked_s_ = steady_now_s();
  last_received_s_.assign(readers_.size(), silence_checked_s_);
  for (std::size_t topic = 0; topic < readers_.size(); ++topic)
    lost_before_.push_back(lost_ever(topic));
}

// Takes all messages, because DDS reports new messages only and not those that remain.
void RosSubscription::take_from(std::size_t topic) {
  constexpr std::size_t kAtOnce = 16;
  std::array<ddsi_serdata*, kAtOnce> samples{};
  std::array<dds_sample_info_t, kAtOnce> infos{};
  for (std::size_t count = kAtOnce; count == kAtOnce;) {
    count = static_cast<std::size_t>(check_dds(
        dds_takecdr(readers_[topic].handle(), samples.data(), kAtOnce, infos.data(), DDS_ANY_STATE),
        "cannot take messages"));
    for (std::size_t k = 0; k < count; ++k) {
      if (infos[k].valid_data) add(topic, *samples[k]);
      ddsi_serdata_unref(samples[k]);
    }
  }
}

void RosSubscription::add(std::size_t topic, const ddsi_serdata& sample) {
  RosMessage message{topic, wall_now(), std::vector<std::uint8_t>(ddsi_serdata_size(&sample))};
  ddsi_serdata_to_ser(&sample, 0, message.bytes.size(), message.bytes.data());
  taken_.push_back(std::move(message));
  last_received_s_[topic] = steady_now_s();
}

// Reports silent topics, because a dead driver or a wrong topic name is the most frequent error.
void RosSubscription::report_silence() {
  const double now_s = steady_now_s();
  if (now_s - silence_checked_s_ < kSilence_s) return;
  silence_checked_s_ = now_s;
  const auto is_read = [this](const std::string& name) {
    return std::ranges::find(topics_, name, &RosTopic::topic) != topics_.end();
  };
  for (std::size_t k = 0; k < topics_.size(); ++k) {
    if (now_s - last_received_s_[k] < kSilence_s) continue;
    const RosTopic& topic = topics_[k];
    const Silence silence = why_silent(topic.topic, topic.type, is_read, discovery_.publishers());
    log::warn("ros") << "nothing on " << topic.topic << " (" << topic.type << ") for "
                     << std::lround(now_s - last_received_s_[k]) << " s on ROS domain "
                     << network_->domain() << ": " << silence.why << "; " << silence.to_do;
  }
}

void RosSubscription::give_up_after(double patience_s) {
  end_s_ = steady_now_s() + patience_s;
}

std::optional<RosMessage> RosSubscription::next() {
  if (last_received_s_.empty()) begin();
  const auto is_over = [this] { return stopped_ || steady_now_s() >= end_s_; };
  while (taken_.empty() && !is_over()) {
    report_silence();
    std::array<dds_attach_t, 16> ready{};
    const auto count = [&] {
      const Heartbeat::Waiting waiting;
      return check_dds(dds_waitset_wait(waitset_.handle(), ready.data(), ready.size(), DDS_SECS(1)),
                       "cannot wait for messages");
    }();
    const auto ready_count = std::min(ready.size(), static_cast<std::size_t>(count));
    for (const dds_attach_t topic : std::span(ready).first(ready_count))
      if (topic >= 0) take_from(static_cast<std::size_t>(topic));
  }
  if (is_over()) return std::nullopt;
  RosMessage message = std::move(taken_.front());
  taken_.pop_front();
  return message;
}

void RosSubscription::stop() noexcept {
  stopped_ = true;
  dds_set_guardcondition(guard_.handle(), true);
}

std::uint64_t RosSubscription::lost(std::size_t topic) const {
  return lost_before_.empty() ? 0 : lost_ever(topic) - lost_before_[topic];
}

std::uint64_t RosSubscription::lost_ever(std::size_t topic) const {
  dds_sample_lost_status_t status{};
  check_dds(dds_get_sample_lost_status(readers_[topic].handle(), &status),
            "cannot count lost messages");
  return status.total_count;
}

}  // namespace km
