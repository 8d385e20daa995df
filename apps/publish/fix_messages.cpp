#include "apps/publish/fix_messages.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "modules/recordings/ros_messages.hpp"

namespace km {

FixMessages::FixMessages(std::unique_ptr<BagReader> recording, std::vector<ReceivedFix> fixes,
                         const std::string& topic, const std::string& type)
    : recording_(std::move(recording)),
      fixes_(std::move(fixes)),
      channels_(recording_->channels()) {
  if (std::ranges::find(channels_, topic, &BagChannel::topic) != channels_.end())
    throw std::invalid_argument("the recording has a topic " + topic +
                                ": give another one with --fix-topic");
  channels_.push_back({topic, type, "cdr", 0});
  std::ranges::stable_sort(fixes_, {}, &ReceivedFix::stamp);
}

BagMessage FixMessages::message_of(const ReceivedFix& fix) const {
  const auto message = [&](const auto& content) {
    return BagMessage{channels_.size() - 1, fix.stamp, encode_ros(content)};
  };
  const Eigen::Vector3d& p = fix.coordinates;
  if (channels_.back().type == kMotionCaptureType) {
    RosPoseStamped pose;
    pose.header.stamp = fix.stamp;
    pose.pose.position = p;
    return message(pose);
  }
  return message(RosNavSatFix{
      .header = {fix.stamp, "gps"}, .latitude = p.x(), .longitude = p.y(), .altitude = p.z()});
}

std::optional<BagMessage> FixMessages::next() {
  if (!next_) next_ = recording_->next();
  if (!next_) return std::nullopt;
  while (!began_ && next_fix_ < fixes_.size() && fixes_[next_fix_].stamp < next_->log_time)
    ++next_fix_;
  began_ = true;
  if (next_fix_ < fixes_.size() && fixes_[next_fix_].stamp < next_->log_time)
    return message_of(fixes_[next_fix_++]);
  return std::exchange(next_, std::nullopt);
}

}  // namespace km
