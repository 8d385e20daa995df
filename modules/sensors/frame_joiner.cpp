#include "modules/sensors/frame_joiner.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace km {
namespace {

// Fault of an image that belongs to no frame.
ReaderFault fault_of_unpaired(ImageRole role) {
  switch (role) {
    case ImageRole::kLeft:
      return ReaderFault::kLeftWithoutRight;
    case ImageRole::kRight:
      return ReaderFault::kRightWithoutLeft;
    case ImageRole::kDepth:
      return ReaderFault::kImageWithoutFrame;
  }
  return ReaderFault::kImageWithoutFrame;
}

}  // namespace

FrameJoiner::FrameJoiner(bool has_right, bool has_depth, std::optional<double> tolerance_s) {
  left_.exists = true;
  right_.exists = has_right;
  depth_.exists = has_depth;
  if (!tolerance_s) return;
  const Synchrony given{.tolerance_s = *tolerance_s};
  if (has_right) right_.synchrony = given;
  if (has_depth) depth_.synchrony = given;
}

FrameJoiner::Stream& FrameJoiner::stream_of(ImageRole role) {
  if (role == ImageRole::kLeft) return left_;
  return role == ImageRole::kRight ? right_ : depth_;
}

void FrameJoiner::drop_oldest(ImageRole role) {
  auto& images = stream_of(role).images;
  report_.add(fault_of_unpaired(role), "stamp " + std::to_string(images.front().stamp));
  images.pop_front();
}

void FrameJoiner::add(ImageRole role, Stamp stamp, BagMessage message) {
  newest_log_time_ = std::max(newest_log_time_, message.log_time);
  auto& images = stream_of(role).images;
  images.push_back({stamp, std::move(message)});
  if (images.size() > kMaxHeld) drop_oldest(role);
}

bool FrameJoiner::has_waited() const {
  return finished_ ||
         seconds_between(left_.images.front().message.log_time, newest_log_time_) > kPatience_s;
}

bool FrameJoiner::knows_synchrony() {
  bool knows_all = true;
  for (Stream* stream : {&right_, &depth_}) {
    if (!stream->exists || stream->synchrony) continue;
    const bool suffices =
        left_.images.size() >= kSample && (stream->images.size() >= kSample || has_waited());
    if (!suffices && !finished_) {
      knows_all = false;
      continue;
    }
    std::vector<Stamp> left, other;
    for (const Held& image : left_.images) left.push_back(image.stamp);
    for (const Held& image : stream->images) other.push_back(image.stamp);
    stream->synchrony = find_synchrony(left, other);
  }
  return knows_all;
}

// Moves the partner of the left image to the front of its stream.
FrameJoiner::Partner FrameJoiner::find_partner(ImageRole role) {
  Stream& stream = stream_of(role);
  if (!stream.exists) return Partner::kNone;
  const Stamp expected = left_.images.front().stamp + nanoseconds(stream.synchrony->offset_s);
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
  while (!left_.images.empty() && knows_synchrony()) {
    const Partner right = find_partner(ImageRole::kRight);
    if (right == Partner::kMayCome) return std::nullopt;
    if (right_.exists && right == Partner::kNone) {
      drop_oldest(ImageRole::kLeft);
      continue;
    }
    const Partner depth = find_partner(ImageRole::kDepth);
    if (depth == Partner::kMayCome) return std::nullopt;
    const auto take = [](Stream& stream) {
      BagMessage message = std::move(stream.images.front().message);
      stream.images.pop_front();
      return message;
    };
    JoinedFrame frame{
        .stamp = left_.images.front().stamp, .left = take(left_), .right = {}, .depth = {}};
    if (right == Partner::kThere) frame.right = take(right_);
    if (depth == Partner::kThere) frame.depth = take(depth_);
    return frame;
  }
  if (finished_ && left_.images.empty())
    for (const ImageRole role : {ImageRole::kRight, ImageRole::kDepth})
      while (!stream_of(role).images.empty()) drop_oldest(role);
  return std::nullopt;
}

}  // namespace km
