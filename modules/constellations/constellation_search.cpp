#include "modules/constellations/constellation_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace km {
namespace {

// Pose of a keyframe in the frame of a stretch.
SE3 pose_in(const ObjectStretch& stretch, const SurfaceKeyframe& keyframe) {
  return make_pose(keyframe.T_world_kf.linear(),
                   keyframe.T_world_kf.translation() - stretch.keyframe.T_world_kf.translation());
}

// The keyframe nearest to a point in the frame of the stretch.
const SurfaceKeyframe& nearest(const ObjectStretch& stretch, const Eigen::Vector3d& point) {
  return *std::ranges::min_element(stretch.keyframes, {}, [&](const SurfaceKeyframe& keyframe) {
    return (pose_in(stretch, keyframe).translation() - point).norm();
  });
}

double distance_m(const OdometryPose& x, const OdometryPose& y) {
  return (x.T_odom_kf.translation() - y.T_odom_kf.translation()).norm();
}

double position_variance(const Closure& closure) {
  return closure.covariance.bottomRightCorner<3, 3>().trace();
}

// The first one has more pairs, or as many and a smaller variance.
bool is_better(const Closure& x, const Closure& y) {
  return x.inliers != y.inliers ? x.inliers > y.inliers
                                : position_variance(x) < position_variance(y);
}

}  // namespace

Closure closure_of(const ObjectStretch& a, const ObjectStretch& b,
                   const ConstellationMatch& match) {
  Eigen::Vector3d middle_a = Eigen::Vector3d::Zero(), middle_b = middle_a;
  for (const auto& [i, p] : match.pairs) {
    middle_a += a.landmarks[i].center;
    middle_b += b.landmarks[p].center;
  }
  middle_a /= static_cast<double>(match.pairs.size());
  middle_b /= static_cast<double>(match.pairs.size());
  const SurfaceKeyframe &from = nearest(a, middle_a), &to = nearest(b, middle_b);
  const SE3 T_a_from = pose_in(a, from), T_b_to = pose_in(b, to);
  const double reach_m = std::hypot((T_a_from.translation() - middle_a).norm(),
                                    (T_b_to.translation() - middle_b).norm());
  UncertainPose T_from_to = compose(compose(inverse({T_a_from, Matrix6::Zero()}), match.T_a_b),
                                    {T_b_to, Matrix6::Zero()});
  T_from_to.Sigma.bottomRightCorner<3, 3>().diagonal().array() +=
      kStretchDrift * kStretchDrift * reach_m * reach_m;
  return {.from = from.odometry,
          .to = to.odometry,
          .T_from_to = T_from_to.T,
          .covariance = T_from_to.Sigma,
          .inliers = static_cast<int>(match.pairs.size())};
}

void ConstellationSearch::add(const RobotObjects& objects, double now_s) {
  if (objects.robot < self_) return;  // that robot searches
  std::vector<Stretch>& stretches = stretches_[objects.robot];
  std::vector<Stretch> former = std::exchange(stretches, {});
  for (ObjectStretch& stretch : stretches_of(objects, min_pairs(options_))) {
    const auto same = std::ranges::find_if(
        former, [&](const Stretch& old) { return !differ(old.objects, stretch); });
    if (same != former.end())
      stretches.push_back(std::move(*same));
    else
      stretches.push_back({std::move(stretch), ++changes_, now_s});
  }
  is_done_ = false;
}

void ConstellationSearch::add(const Closure& closure) {
  const RobotId from = closure.from.id.robot, to = closure.to.id.robot;
  if (from == to || std::min(from, to) != self_) return;
  places_[closure.id()] =
      from == self_ ? Place{closure.from, closure.to} : Place{closure.to, closure.from};
}

void ConstellationSearch::forget(RobotId robot) {
  stretches_.erase(robot);
  const auto is_old = [&](const auto& entry) { return touches(entry.first, robot); };
  std::erase_if(tried_, is_old);
  std::erase_if(found_, is_old);
  std::erase_if(places_, is_old);
}

bool ConstellationSearch::is_known_place(const OdometryPose& own, const OdometryPose& peer) const {
  return std::ranges::any_of(places_, [&](const auto& entry) {
    const Place& place = entry.second;
    return place.peer.id.robot == peer.id.robot && distance_m(place.own, own) < kStretchRadius_m &&
           distance_m(place.peer, peer) < kStretchRadius_m;
  });
}

bool ConstellationSearch::is_tried(const Stretch& own, const Stretch& peer) const {
  const auto tried =
      tried_.find({own.objects.keyframe.odometry.id, peer.objects.keyframe.odometry.id});
  return tried != tried_.end() && tried->second >= std::max(own.version, peer.version);
}

std::optional<Closure> ConstellationSearch::match(const Stretch& own, const Stretch& peer) {
  const ObjectStretch &a = own.objects, &b = peer.objects;
  tried_[{a.keyframe.odometry.id, b.keyframe.odometry.id}] = std::max(own.version, peer.version);
  const ConstellationMatch result = match_constellations(a.landmarks, b.landmarks, options_);
  ++counts_[result.status];
  if (result.status != ConstellationStatus::kMatched) return std::nullopt;
  Closure closure = closure_of(a, b, result);
  if (position_variance(closure) > 3.0 * kMaxSigma_m * kMaxSigma_m) return std::nullopt;
  return closure;
}

std::optional<Closure> ConstellationSearch::take_best() {
  std::erase_if(found_, [&](const auto& entry) {
    return is_known_place(entry.second.from, entry.second.to);
  });
  if (found_.empty()) return std::nullopt;
  const auto best = std::ranges::min_element(
      found_, is_better, [](const auto& entry) -> const Closure& { return entry.second; });
  Closure closure = std::move(best->second);
  found_.erase(best);
  add(closure);
  return closure;
}

std::optional<Closure> ConstellationSearch::step(double now_s) {
  if (is_done_) return std::nullopt;
  bool is_waiting = false;
  for (const auto& [robot, peers] : stretches_) {
    if (robot == self_) continue;
    for (const Stretch& own : stretches_[self_])
      for (const Stretch& peer : peers) {
        if (is_tried(own, peer) ||
            is_known_place(own.objects.keyframe.odometry, peer.objects.keyframe.odometry))
          continue;
        is_waiting = true;
        if (now_s - std::max(own.changed_s, peer.changed_s) < kCalm_s) continue;
        if (auto closure = match(own, peer))
          found_.insert_or_assign(closure->id(), *std::move(closure));
        return std::nullopt;
      }
  }
  std::optional<Closure> closure = take_best();
  is_done_ = !is_waiting && found_.empty();
  return closure;
}

}  // namespace km
