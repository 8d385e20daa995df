#include "modules/place_recognition/known_places.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace km {
namespace {

// Pose of keyframe b in keyframe a of the same robot, by odometry.
UncertainPose odometry_between(const OdometryPose& a, const OdometryPose& b) {
  const UncertainPose T_odom_a{a.T_odom_kf, a.covariance}, T_odom_b{b.T_odom_kf, b.covariance};
  return a.id.index <= b.id.index ? between_on_chain(T_odom_a, T_odom_b)
                                  : inverse(between_on_chain(T_odom_b, T_odom_a));
}

double root_of_trace(const Eigen::Matrix3d& Sigma) {
  return std::sqrt(std::max(Sigma.trace(), 0.0));
}

// True if both poses see the same, at a place whose median depth is `depth_m`.
bool is_near(const UncertainPose& T, double depth_m) {
  const double reach_m = KnownPlaces::kReach_depths * depth_m;
  return T.T.translation().norm() <= reach_m &&
         Eigen::AngleAxisd(T.T.linear()).angle() <= KnownPlaces::kTurn_rad &&
         root_of_trace(T.Sigma.bottomRightCorner<3, 3>()) <= KnownPlaces::kSigma_share * reach_m &&
         root_of_trace(T.Sigma.topLeftCorner<3, 3>()) <=
             KnownPlaces::kSigma_share * KnownPlaces::kTurn_rad;
}

}  // namespace

void KnownPlaces::add_view(const OdometryPose& keyframe, double median_depth_m) {
  views_[keyframe.id.index] = {keyframe, median_depth_m};
}

void KnownPlaces::add_closure(const Closure& closure) {
  Tie tie{closure.from, closure.to, {closure.T_from_to, closure.covariance}};
  if (tie.late.id < tie.early.id) {
    std::swap(tie.early, tie.late);
    tie.T_early_late = inverse(tie.T_early_late);
  }
  const auto early = views_.find(tie.early.id.index);
  if (early != views_.end() && !(early->second.median_depth_m > 0.0)) return;
  if (!tie_ || tie_->late.id.index <= tie.late.id.index) tie_ = tie;
}

PlaceNovelty KnownPlaces::novelty_of(const OdometryPose& keyframe,
                                     std::span<const KeyframeIndex> similar) const {
  if (!tie_ || keyframe.id.index < tie_->late.id.index) return PlaceNovelty::kNew;
  const KeyframeIndex age = keyframe.id.index - tie_->late.id.index;
  if (age > kValidKeyframes) return PlaceNovelty::kNew;
  const UncertainPose T_early_kf =
      compose(tie_->T_early_late, odometry_between(tie_->late, keyframe));
  const bool is_known = std::ranges::any_of(similar, [&](KeyframeIndex index) {
    const auto view = views_.find(index);
    if (view == views_.end()) return false;
    return is_near(compose(odometry_between(view->second.odometry, tie_->early), T_early_kf),
                   view->second.median_depth_m);
  });
  if (!is_known) return PlaceNovelty::kNew;
  return age > kFreshKeyframes ? PlaceNovelty::kKnown : PlaceNovelty::kCovered;
}

}  // namespace km
