#include "modules/sensors/load_shedding.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace km {
namespace {

constexpr double kFirstCalm_s = 2.0;
constexpr double kMostCalm_s = 30.0;
constexpr double kSmoothing = 0.2;          // weight of the newest image in the rate of losses
constexpr double kLeastShare = 0.01;        // lower bound on a share, for the logarithm
constexpr double kLongestInterval_s = 1.0;  // longest interval between images that is no pause

}  // namespace

LoadShedding::LoadShedding(double max_lag_s) : max_lag_s_(max_lag_s), calm_needed_s_(kFirstCalm_s) {
  if (!(max_lag_s >= 0.0))
    throw std::invalid_argument("LoadShedding: max_lag_s " + std::to_string(max_lag_s) +
                                " is negative");
}

double LoadShedding::lag_s(double now_s) const {
  return unfinished_.empty() ? 0.0 : std::max(0.0, now_s - unfinished_.front().due_s);
}

double LoadShedding::pause_s(double due_s, double now_s) const {
  const double late_s = std::max(lag_s(now_s), now_s - due_s);
  return late_s > 2.0 * max_lag_s_ ? late_s - 1.5 * max_lag_s_ : 0.0;
}

void LoadShedding::pause(double s) {
  for (Unfinished& frame : unfinished_) frame.due_s += s;
}

int LoadShedding::max_stride() const {
  if (loss_per_s_ <= 0.0 || period_s_ <= 0.0) return kMaxStride;
  const double longest_s = -std::log(kMinTrackedShare) / loss_per_s_;
  return static_cast<int>(std::clamp(longest_s / period_s_, 1.0, double{kMaxStride}));
}

FrameUse LoadShedding::use_next(Stamp stamp, double due_s, double now_s) {
  if (last_image_) {
    const double interval_s = seconds_between(*last_image_, stamp);
    if (interval_s > 0.0 && interval_s < kLongestInterval_s) period_s_ = interval_s;
  }
  last_image_ = stamp;
  const double late_s = std::max(lag_s(now_s), now_s - due_s);
  adapt(late_s, now_s);
  if (late_s > 2.0 * max_lag_s_ || ++left_out_ < load_.stride) return FrameUse::kNone;
  left_out_ = 0;
  unfinished_.push_back({stamp, due_s});
  return load_.map ? FrameUse::kOdometry : FrameUse::kAll;
}

void LoadShedding::adapt(double lag_s, double now_s) {
  const bool is_calm = lag_s <= max_lag_s_ / 4.0;
  if (!is_calm) calm_since_s_.reset();
  if (is_calm && !calm_since_s_) calm_since_s_ = now_s;
  if (lag_s > max_lag_s_ / 2.0) load_.map = true;
  if (load_.stride > max_stride()) {
    load_.stride = max_stride();
    changed_s_ = now_s;
  }
  // A step takes effect only after the frames in processing are finished.
  if (lag_s > max_lag_s_ && load_.stride < max_stride() &&
      (load_.stride == 1 || now_s - changed_s_ > 2.0 * max_lag_s_))
    take_step(now_s);
  if (is_calm && now_s - *calm_since_s_ >= calm_needed_s_) undo_step(now_s);
}

void LoadShedding::take_step(double now_s) {
  if (undone_) calm_needed_s_ = std::min(2.0 * calm_needed_s_, kMostCalm_s);
  undone_ = false;
  ++load_.stride;
  changed_s_ = now_s;
}

void LoadShedding::undo_step(double now_s) {
  if (load_.stride > 1) {
    --load_.stride;
    undone_ = true;
    changed_s_ = now_s;
  } else {
    load_.map = false;
  }
  calm_since_s_ = now_s;
}

void LoadShedding::finish(const ProcessedFrame& frame) {
  while (!unfinished_.empty() && unfinished_.front().stamp <= frame.stamp) unfinished_.pop_front();
  if (frame.tracked_share >= 0.0 && last_finished_) {  // not NaN
    const double interval_s = seconds_between(*last_finished_, frame.stamp);
    if (interval_s > 0.0 && interval_s < kLongestInterval_s) {
      const double share = std::clamp(*frame.tracked_share, kLeastShare, 1.0);
      loss_per_s_ += kSmoothing * (-std::log(share) / interval_s - loss_per_s_);
    }
  }
  last_finished_ = frame.stamp;
}

}  // namespace km
