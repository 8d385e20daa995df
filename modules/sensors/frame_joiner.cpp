#include "modules/sensors/frame_joiner.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace km {
namespace {

// Fault of an image that belongs to no frame.
ReaderFault fault_of_unpaired(SensorRole role) {
  if (role == SensorRole::kLeft) return ReaderFault::kLeftWithoutRight;
  return role == SensorRole::kRight ? ReaderFault::kRightWithoutLeft
                                    : ReaderFault::kImageWithoutFrame;
}

}  // namespace

FrameJoiner::FrameJoiner(bool has_right, bool has_depth) {
  stream_of(SensorRole::kLeft).exists = true;
  stream_of(SensorRole::kRight).exists = has_right;
  stream_of(SensorRole::kDepth).exists = has_depth;
}

void FrameJoiner::drop_oldest(SensorRole role) {
  auto& images = stream_of(role).images;
  report_.add(fault_of_unpaired(role), "stamp " + std::to_string(images.front().stamp));
  images.pop_front();
}

void FrameJoiner::add(SensorRole role, Stamp stamp, BagMessage message) {
  newest_log_time_ = std::max(newest_log_time_, message.log_time);
  auto& images = stream_of(role).images;
  images.push_back({stamp, std::move(message)});
  if (images.size() > kMaxHeld) drop_oldest(role);
}

bool FrameJoiner::has_waited() const {
  return finished_ ||
         seconds_between(left().front().message.log_time, newest_log_time_) > kPatience_s;
}

bool FrameJoiner::knows_synchrony() {
  bool knows_all = true;
  for (const SensorRole role : {SensorRole::kRight, SensorRole::kDepth}) {
    Stream& stream = stream_of(role);
    if (!stream.exists || stream.synchrony) continue;
    const bool suffices =
        left().size() >= kSample && (stream.images.size() >= kSample || has_waited());
    if (!suffices && !finished_) {
      knows_all = false;
      continue;
    }
    std::vector<Stamp> lefts, others;
    for (const Held& image : left()) lefts.push_back(image.stamp);
    for (const Held& image : stream.images) others.push_back(image.stamp);
    stream.synchrony = find_synchrony(lefts, others);
  }
  return knows_all;
}

// Moves the partner of the left image to the front of its stream.
FrameJoiner::Partner FrameJoiner::find_partner(SensorRole role) {
  Stream& stream = stream_of(role);
  if (!stream.exists) return Partner::kNone;
  const Stamp expected = left().front().stamp + nanoseconds(stream.synchrony->offset_s);
  const double tolerance_s = stream.synchrony->tolerance_s;
  while (!stream.images.empty()) {
    const double late_s = seconds_between(expected, stream.images.front().stamp);
    if (std::abs(late_s) <= tolerance_s) return Partner::kThere;
    if (late_s > 0.0) return Partner::kNone;
    drop_oldest(role);
  }
  return has_waited() ? Partner::kNone : Partner::kMayCome;
}

std::optional<JoinedFrame> FrameJoiner::next() {
  while (!left().empty() && knows_synchrony()) {
    const Partner right = find_partner(SensorRole::kRight);
    if (right == Partner::kMayCome) return std::nullopt;
    if (stream_of(SensorRole::kRight).exists && right == Partner::kNone) {
      drop_oldest(SensorRole::kLeft);
      continue;
    }
    const Partner depth = find_partner(SensorRole::kDepth);
    if (depth == Partner::kMayCome) return std::nullopt;
    const auto take = [this](SensorRole role) {
      auto& images = stream_of(role).images;
      BagMessage message = std::move(images.front().message);
      images.pop_front();
      return message;
    };
    JoinedFrame frame{
        .stamp = left().front().stamp, .left = take(SensorRole::kLeft), .right = {}, .depth = {}};
    if (right == Partner::kThere) frame.right = take(SensorRole::kRight);
    if (depth == Partner::kThere) frame.depth = take(SensorRole::kDepth);
    return frame;
  }
  if (finished_ && left().empty())
    for (const SensorRole role : {SensorRole::kRight, SensorRole::kDepth})
      while (!stream_of(role).images.empty()) drop_oldest(role);
  return std::nullopt;
}

}  // namespace km
