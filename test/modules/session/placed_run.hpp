#pragma once

#include "modules/core/data/measurement_limits.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/rbcd/solver_choice.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/team_network.hpp"
#include "test/support/test.hpp"

namespace km {

inline constexpr KeyframeIndex kRunKeyframes = 60;

/// A robot with noisy odometry in a frame that is known before: of a map, or of absolute fixes.
class PlacedRun {
 public:
  [[nodiscard]] const TeamNetwork::Robot& state() const { return network_.robots.at(robot_); }
  [[nodiscard]] TeamAgent& agent() { return agent_; }
  [[nodiscard]] RobotId robot() const { return robot_; }
  [[nodiscard]] const SE3& truth(KeyframeIndex i) const { return truth_[i]; }
  /// Largest distance of a keyframe, from `first` on, from its true position in the frame.
  [[nodiscard]] double error_m(KeyframeIndex first = 0) const {
    double largest = 0.0;
    for (KeyframeIndex i = first; i < kRunKeyframes; ++i)
      largest = std::max(
          largest,
          (state().trajectory->T_world_kf[i].translation() - truth_[i].translation()).norm());
    return largest;
  }

 protected:
  /// `upright`: keyframes have verticals.
  PlacedRun(TeamNetwork& network, RobotId robot, unsigned seed, PgoMethod method, bool upright)
      : rng_(seed),
        network_(network),
        robot_(robot),
        upright_(upright),
        agent_(network.add({robot, 1}, {.method = method}, solver_choice({.method = method}))) {}

  /// Adds the first keyframe.
  void begin(const SE3& T_frame_kf, const SE3& T_odom_kf) {
    add(T_frame_kf, T_odom_kf, Matrix6::Zero());
  }
  /// Adds a keyframe after an unknown step.
  void jump(const SE3& T_frame_kf, const SE3& T_previous_kf) {
    add(T_frame_kf, T_previous_kf, isotropic(kUnknownTurn_rad, kUnknownStep_m));
  }
  /// Adds the remaining keyframes, with noise.
  void walk(const SE3& step) {
    while (truth_.size() < kRunKeyframes)
      add(truth_.back() * step, step * noise(0.002, 0.01), isotropic(0.002, 0.01));
  }
  SE3 noise(double rotation_rad, double translation_m) {
    Vector6 xi = random_vector<6>(rng_);
    xi.head<3>() *= rotation_rad;
    xi.tail<3>() *= translation_m;
    return se3_exp(xi);
  }

  std::mt19937 rng_;

 private:
  void add(const SE3& T_frame_kf, const SE3& T_previous_kf, const Matrix6& covariance) {
    KeyframeOdometry keyframe{.id = {robot_, static_cast<KeyframeIndex>(truth_.size())}};
    keyframe.T_previous_kf = T_previous_kf;
    keyframe.T_odom_kf = T_odom_kf_ = T_odom_kf_ * T_previous_kf;
    keyframe.covariance = covariance;
    if (upright_) keyframe.vertical = Vertical{T_frame_kf.linear().row(2).transpose(), 0.01};
    CHECK(agent_.add(keyframe));
    truth_.push_back(T_frame_kf);
  }

  TeamNetwork& network_;
  RobotId robot_;
  bool upright_;
  TeamAgent& agent_;
  std::vector<SE3> truth_;  // T_frame_kf
  SE3 T_odom_kf_ = SE3::Identity();
};

/// Gives both robots closures between equal keyframes of two places, off by `error`.
inline std::vector<ClosureId> close(PlacedRun& low, PlacedRun& high,
                                    const SE3& error = SE3::Identity(),
                                    const std::vector<KeyframeIndex>& at = {10, 11, 12, 40, 41,
                                                                            42}) {
  std::vector<ClosureId> between;
  for (const KeyframeIndex i : at) {
    Closure closure;
    closure.from.id = {low.robot(), i};
    closure.to.id = {high.robot(), i};
    closure.T_from_to = low.truth(i).inverse() * high.truth(i) * error;
    closure.covariance = isotropic(0.005, 0.02);
    between.push_back(closure.id());
    for (PlacedRun* const run : {&low, &high}) CHECK(run->agent().add(closure));
  }
  for (PlacedRun* const run : {&low, &high})
    CHECK(run->agent().add(InlierSet{low.robot(), high.robot(), 1, between}));
  return between;
}

}  // namespace km
