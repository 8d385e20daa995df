#include "modules/vio/vision_watch.hpp"

namespace km {

std::optional<VisionEvent> VisionWatch::add(Stamp stamp, int features, int seen) {
  const bool sees = seen >= kMinLandmarks;
  has_seen_ = has_seen_ || sees;
  if (!has_seen_ || (sees && !since_)) return std::nullopt;
  if (!since_) since_ = stamp;
  now_lost_s_ = seconds_between(*since_, stamp);
  const VisionEvent event{!sees, *since_, now_lost_s_, features};
  if (sees) {
    since_.reset();
    if (!is_lost_) return std::nullopt;
    is_lost_ = false;
    lost_s_ += now_lost_s_;
    return event;
  }
  if (is_lost_ || now_lost_s_ < patience_s_) return std::nullopt;
  is_lost_ = true;
  ++losses_;
  return event;
}

}  // namespace km
