#include "modules/view/view_selector.hpp"

#include <algorithm>
#include <limits>

namespace km {
namespace {

constexpr std::size_t kBytesOfPose = 7 * sizeof(float);
constexpr std::size_t kPosesAtOnce = ViewSelector::kUpdateBytes / kBytesOfPose;
constexpr std::size_t kOdometryAtOnce = ViewSelector::kUpdateBytes / (kBytesOfPose + sizeof(Stamp));

// Verified closures rank above all other updates, the many other closures below new keyframes.
constexpr int kVerifiedRank = 0;
constexpr int kCandidateRank = 1;

std::size_t bytes_of(const ViewClosure& closure) {
  constexpr std::size_t kMostFixed = 2 * (3 + 5) + 1 + 3 + 3 + 2;
  return kMostFixed + closure.reason.size();
}

std::uint16_t small(int count) {
  return static_cast<std::uint16_t>(
      std::clamp<int>(count, 0, std::numeric_limits<std::uint16_t>::max()));
}

template <typename T>
std::vector<T> part(const std::vector<T>& list, std::size_t first, std::size_t end) {
  const auto begin = list.begin();
  return {begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(end)};
}

}  // namespace

void ViewSelector::add(const OdometryState& state) {
  if (state.T_odom_body.matrix().allFinite()) pose_ = ViewPose{state.stamp, state.T_odom_body};
}

// A missing keyframe takes the pose and the stamp of the next one.
void ViewSelector::add(const KeyframeOdometry& keyframe) {
  if (!keyframe.T_odom_kf.matrix().allFinite()) return;
  const auto index = static_cast<std::size_t>(keyframe.id.index);
  if (index < odometry_.size()) return;
  odometry_.resize(index + 1, keyframe.T_odom_kf);
  stamps_.resize(index + 1, keyframe.stamp);
}

void ViewSelector::add(const PoseChanges& changes) {
  if (std::exchange(anchor_, changes.anchor) != changes.anchor) {
    optimized_.clear();
    unsent_.clear();
  }
  for (const auto& [id, T_world_kf, covariance] : changes.poses) {
    if (id.robot != self_) continue;
    optimized_[id.index] = T_world_kf;
    unsent_.insert(id.index);
  }
}

void ViewSelector::add(const ClosureOutcome& outcome) {
  const ClosureId id = closure_id(outcome.id.from, outcome.id.to);
  Pair& pair = pairs_[id];
  pair.is_known = true;
  pair.is_verified |= outcome.stage >= ClosureStage::kVerified;
  pair.reason = outcome.reason;
  pair.matches = std::max(pair.matches, small(outcome.matches));
  pair.inliers = std::max(pair.inliers, small(outcome.inliers));
  look_at(id, pair);
}

void ViewSelector::add(const Closure& closure) {
  if (!touches(closure.id(), self_)) return;
  Pair& pair = pairs_[closure.id()];
  pair.is_known = pair.is_verified = true;
  pair.inliers = std::max(pair.inliers, small(closure.inliers));
  look_at(closure.id(), pair);
}

void ViewSelector::add(const ClosureJudgements& judgements) {
  for (const ClosureJudgement& judgement : judgements.closures) {
    Pair& pair = pairs_[judgement.id];
    pair.judgement = judgement;
    look_at(judgement.id, pair);
  }
}

void ViewSelector::restarted(RobotId peer) {
  for (auto& [id, pair] : pairs_) {
    if (!touches(id, peer)) continue;
    pair.is_verified = false;
    pair.judgement = {};
    pair.reason = "its robot was restarted";
    look_at(id, pair);
  }
}

void ViewSelector::begin_again() {
  sends_past_ = true;
  odometry_sent_ = 0;
  for (const auto& [index, T_world_kf] : optimized_) unsent_.insert(index);
  if (!sample_) sample_ = sent_sample_;
  for (auto& [id, pair] : pairs_) {
    pair.sent.reset();
    look_at(id, pair);
  }
}

ViewClosure ViewSelector::view_of(const ClosureId& id, const Pair& pair) const {
  ViewClosure view{id, ClosureStatus::kCandidate, pair.matches, pair.inliers, {}};
  const auto reject = [&](const std::string& reason) {
    view.verdict = ClosureStatus::kRejected;
    view.reason = reason;
  };
  if (!pair.is_verified) {
    if (!pair.reason.empty()) reject(pair.reason);
    return view;
  }
  view.verdict = pair.judgement.selected ? ClosureStatus::kKept : ClosureStatus::kVerified;
  if (pair.judgement.overruled) reject("the other closures contradict it");
  return view;
}

// Queues the pair if its present state differs from the one that was sent.
void ViewSelector::look_at(const ClosureId& id, Pair& pair) {
  if (!pair.is_known) return;
  const ViewClosure now = view_of(id, pair);
  const bool news = !pair.sent || *pair.sent != now;
  for (const int rank : {kVerifiedRank, kCandidateRank}) waiting_.erase({rank, pair.turn, id});
  if (!news) {
    pair.turn = 0;
    return;
  }
  if (pair.turn == 0) pair.turn = ++turn_;
  waiting_.insert({pair.is_verified ? kVerifiedRank : kCandidateRank, pair.turn, id});
}

std::optional<ViewContent> ViewSelector::next_closures(int max_rank) {
  ViewClosures update;
  std::size_t bytes = 0;
  while (!waiting_.empty() && std::get<int>(*waiting_.begin()) <= max_rank) {
    const ClosureId id = std::get<ClosureId>(*waiting_.begin());
    Pair& pair = pairs_.at(id);
    ViewClosure closure = view_of(id, pair);
    bytes += bytes_of(closure);
    if (!update.closures.empty() && bytes > kUpdateBytes) break;
    waiting_.erase(waiting_.begin());
    pair.turn = 0;
    pair.sent = closure;
    update.closures.push_back(std::move(closure));
  }
  if (update.closures.empty()) return std::nullopt;
  return update;
}

std::optional<ViewContent> ViewSelector::next_odometry() {
  const std::size_t first = odometry_sent_;
  if (first >= odometry_.size()) return std::nullopt;
  odometry_sent_ = std::min(odometry_.size(), first + kOdometryAtOnce);
  return ViewKeyframes{false, self_, static_cast<KeyframeIndex>(first),
                       part(odometry_, first, odometry_sent_),
                       part(stamps_, first, odometry_sent_)};
}

// Starts behind the poses sent last, so that each pose is sent even if all poses keep moving.
std::optional<ViewContent> ViewSelector::next_optimized() {
  if (unsent_.empty()) return std::nullopt;
  auto pose = unsent_.lower_bound(cursor_);
  if (pose == unsent_.end()) pose = unsent_.begin();
  ViewKeyframes update{true, anchor_, *pose, {}};
  cursor_ = update.first;
  while (pose != unsent_.end() && *pose == cursor_ && update.T_world_kf.size() < kPosesAtOnce) {
    update.T_world_kf.push_back(optimized_.at(cursor_++));
    pose = unsent_.erase(pose);
  }
  return update;
}

std::optional<ViewContent> ViewSelector::next(double now_s) {
  if (auto update = next_closures(kVerifiedRank)) return update;
  if (sample_) return *(sent_sample_ = std::exchange(sample_, std::nullopt));
  if (pose_ && now_s >= pose_due_s_) {
    pose_due_s_ = now_s + kPosePeriod_s;
    return *std::exchange(pose_, std::nullopt);
  }
  const bool are_keyframes_due = sends_past_ || now_s >= keyframes_due_s_;
  if (are_keyframes_due)
    if (auto update = next_odometry()) return update;
  if (auto update = next_closures(kCandidateRank)) return update;
  if (are_keyframes_due) {
    if (auto update = next_optimized()) return update;
    keyframes_due_s_ = now_s + kKeyframePeriod_s;
  }
  sends_past_ = false;
  return std::nullopt;
}

}  // namespace km
