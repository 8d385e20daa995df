#include "modules/view/view_selector.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace km {
namespace {

constexpr std::size_t kBytesOfPose = 7 * sizeof(float);
constexpr std::size_t kPosesAtOnce = ViewSelector::kUpdateBytes / kBytesOfPose;
constexpr std::size_t kOdometryAtOnce = ViewSelector::kUpdateBytes / (kBytesOfPose + sizeof(Stamp));

// Verified closures rank above all other updates, the many other closures below new keyframes.
constexpr int kVerifiedRank = 0;
constexpr int kCandidateRank = 1;

bool is_same(const ViewClosure& a, const ViewClosure& b) {
  return a.verdict == b.verdict && a.matches == b.matches && a.inliers == b.inliers &&
         a.reason == b.reason;
}

std::size_t bytes_of(const ViewClosure& closure) {
  constexpr std::size_t kMostFixed = 2 * (3 + 5) + 1 + 3 + 3 + 2;
  return kMostFixed + closure.reason.size();
}

std::uint16_t small(int count) {
  return static_cast<std::uint16_t>(
      std::clamp<int>(count, 0, std::numeric_limits<std::uint16_t>::max()));
}

bool has_moved(const SE3& sent, const SE3& now) {
  static const double kMinCosine = std::cos(ViewSelector::kMaxTurn_rad);
  const double cosine = 0.5 * ((sent.linear().transpose() * now.linear()).trace() - 1.0);
  return (sent.translation() - now.translation()).norm() > ViewSelector::kMaxShift_m ||
         cosine < kMinCosine;
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

void ViewSelector::add(std::shared_ptr<const Trajectory> trajectory) {
  const auto is_finite = [](const SE3& T) { return T.matrix().allFinite(); };
  if (trajectory->robot != self_ || !std::ranges::all_of(trajectory->T_world_kf, is_finite)) return;
  if (trajectory_ != nullptr && trajectory_->anchor != trajectory->anchor) optimized_sent_.clear();
  trajectory_ = std::move(trajectory);
  any_moved_ = true;
}

void ViewSelector::add(const ClosureOutcome& outcome) {
  const ClosureId id = closure_id(outcome.id.from, outcome.id.to);
  Pair& pair = pairs_[id];
  pair.is_verified |= outcome.stage >= ClosureStage::kVerified;
  pair.reason = outcome.reason;
  pair.matches = std::max(pair.matches, small(outcome.matches));
  pair.inliers = std::max(pair.inliers, small(outcome.inliers));
  look_at(id, pair);
}

void ViewSelector::add(const Closure& closure) {
  if (!touches(closure.id(), self_)) return;
  Pair& pair = pairs_[closure.id()];
  pair.is_verified = true;
  pair.inliers = std::max(pair.inliers, small(closure.inliers));
  look_at(closure.id(), pair);
}

void ViewSelector::add(const InlierSet& set) {
  if (set.a != self_ && set.b != self_) return;
  InlierSet& newest = inlier_sets_[{set.a, set.b}];
  if (set.version < newest.version) return;
  newest = set;
  for (auto& [id, pair] : pairs_)
    if (std::minmax(id.from.robot, id.to.robot) == std::minmax(set.a, set.b)) look_at(id, pair);
}

void ViewSelector::add(const ClosureVerdicts& verdicts) {
  for (const auto& [id, is_kept] : verdicts.closures) {
    const bool news = is_kept ? overruled_.erase(id) > 0 : overruled_.insert(id).second;
    const auto pair = pairs_.find(id);
    if (news && pair != pairs_.end()) look_at(pair->first, pair->second);
  }
}

void ViewSelector::restarted(RobotId peer) {
  inlier_sets_.erase(std::minmax(self_, peer));
  std::erase_if(overruled_, [&](const ClosureId& id) { return touches(id, peer); });
  for (auto& [id, pair] : pairs_) {
    if (!touches(id, peer)) continue;
    pair.is_verified = false;
    pair.reason = "its robot was restarted";
    look_at(id, pair);
  }
}

void ViewSelector::begin_again() {
  sends_past_ = true;
  odometry_sent_ = 0;
  optimized_sent_.clear();
  for (auto& [id, pair] : pairs_) {
    pair.sent.reset();
    look_at(id, pair);
  }
}

ViewClosure ViewSelector::view_of(const ClosureId& id, const Pair& pair) const {
  ViewClosure view{id, ViewVerdict::kCandidate, pair.matches, pair.inliers, {}};
  const auto reject = [&](const std::string& reason) {
    view.verdict = ViewVerdict::kRejected;
    view.reason = reason;
  };
  if (!pair.is_verified) {
    if (!pair.reason.empty()) reject(pair.reason);
    return view;
  }
  const auto set = inlier_sets_.find(std::minmax(id.from.robot, id.to.robot));
  const bool is_inlier =
      set != inlier_sets_.end() && std::ranges::binary_search(set->second.closures, id);
  view.verdict = is_inlier ? ViewVerdict::kKept : ViewVerdict::kVerified;
  if (overruled_.contains(id)) reject("the other closures contradict it");
  return view;
}

// Queues the pair if its present state differs from the one that was sent.
void ViewSelector::look_at(const ClosureId& id, Pair& pair) {
  const ViewClosure now = view_of(id, pair);
  const bool news = !pair.sent || !is_same(*pair.sent, now);
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

std::optional<ViewContent> ViewSelector::next_optimized() {
  const std::size_t first = optimized_sent_.size();
  if (trajectory_ == nullptr || first >= trajectory_->T_world_kf.size()) return std::nullopt;
  const std::size_t end = std::min(trajectory_->T_world_kf.size(), first + kPosesAtOnce);
  std::vector<SE3> poses = part(trajectory_->T_world_kf, first, end);
  optimized_sent_.insert(optimized_sent_.end(), poses.begin(), poses.end());
  return ViewKeyframes{true, trajectory_->anchor, static_cast<KeyframeIndex>(first),
                       std::move(poses)};
}

// Starts behind the poses sent last, so that each pose is sent even if all poses keep moving.
std::optional<ViewContent> ViewSelector::next_moved() {
  if (!any_moved_ || trajectory_ == nullptr) return std::nullopt;
  const auto& now = trajectory_->T_world_kf;
  const std::size_t count = std::min(now.size(), optimized_sent_.size());
  const auto moved = [&](std::size_t k) { return has_moved(optimized_sent_[k], now[k]); };
  for (std::size_t step = 0; step < count; ++step) {
    const std::size_t first = (cursor_ + step) % count;
    if (!moved(first)) continue;
    std::size_t end = first;
    for (; end < count && end < first + kPosesAtOnce && moved(end); ++end)
      optimized_sent_[end] = now[end];
    cursor_ = end;
    return ViewKeyframes{true, trajectory_->anchor, static_cast<KeyframeIndex>(first),
                         part(now, first, end)};
  }
  any_moved_ = false;
  return std::nullopt;
}

std::optional<ViewContent> ViewSelector::next(double now_s) {
  if (auto update = next_closures(kVerifiedRank)) return update;
  if (pose_ && now_s >= pose_due_s_) {
    pose_due_s_ = now_s + kPosePeriod_s;
    return *std::exchange(pose_, std::nullopt);
  }
  const bool are_keyframes_due = sends_past_ || now_s >= keyframes_due_s_;
  if (are_keyframes_due) {
    if (auto update = next_odometry()) return update;
    if (auto update = next_optimized()) return update;
  }
  if (auto update = next_closures(kCandidateRank)) return update;
  sends_past_ = false;
  if (are_keyframes_due) {
    if (auto update = next_moved()) return update;
    keyframes_due_s_ = now_s + kKeyframePeriod_s;
  }
  return std::nullopt;
}

}  // namespace km
