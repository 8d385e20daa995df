#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/robust/robust_schedule.hpp"
#include "modules/robust/tree_messages.hpp"
#include "modules/tree_newton/tree_front.hpp"

namespace km {

struct TreeNewtonOptions {
  int dimension = 3;  ///< 2: poses and measurements are planar.
  /// Predicted decrease of a step at the end, relative to the cost F. No motion of the team then
  /// errs by more than 1.5e-9 sqrt(F) of its standard deviation.
  double tolerance = 1e-18;
  double absolute_tolerance = 1e-17;  ///< Predicted decrease at the end, if the cost is near 0.
  /// Second derivatives are sent again, at the price of an elimination and its bytes, if more
  /// rounds than this would remain at the convergence rate of the old ones.
  double patience_rounds = 30.0;
  std::uint32_t max_rounds = 1000;  ///< Largest number of rounds.
  bool robust = true;               ///< Closures are weighed; otherwise all are trusted.
  double barc = 0.0;        ///< Largest residual of an inlier [sigma]; 0: the team estimates it.
  bool covariances = true;  ///< The members compute covariances at the end.
};

/// Decisions of the root of the tree in each round, from the sums of the team and from its front,
/// which solves the equations of the whole team. Not thread-safe.
class TreeRoot {
 public:
  /// `members`: of the session, ascending. `again`: see SessionGraph. `noisy`: the odometry of a
  /// member is noisier than it claims.
  TreeRoot(std::vector<RobotId> members, const TreeNewtonOptions& options, bool upright,
           bool again = false, bool noisy = false)
      : members_(std::move(members)),
        options_(options),
        upright_(upright),
        again_(again),
        noisy_(noisy) {}

  /// Decides, before there are equations, when the team starts and with which closures.
  [[nodiscard]] DownMessage decide_start(const TreeSums& sums, std::uint32_t round);
  /// Decides after the pass up of a round. `front` has the equations at `poses` (of its followed
  /// nodes), unless they could not be factorised.
  [[nodiscard]] DownMessage decide(const TreeSums& sums, std::uint32_t round,
                                   const TreeFront& front, std::span<const SE3> poses,
                                   bool factorised);
  /// Repeats the round with Gauss-Newton derivatives, because a robot could not eliminate with full
  /// ones.
  [[nodiscard]] DownMessage retreat(std::uint32_t round);
  /// Ends the session, because the team cannot continue.
  [[nodiscard]] DownMessage stop(std::uint32_t round);

 private:
  [[nodiscard]] DownMessage answer(TreeVerdict::Next next) const;
  [[nodiscard]] DownMessage start(bool deferred, const TreeSums& sums);
  [[nodiscard]] DownMessage step(const TreeSums& sums, const TreeFront& front,
                                 std::span<const SE3> poses);
  [[nodiscard]] DownMessage go_back();
  [[nodiscard]] DownMessage refresh(bool accept, TreeVerdict::Weighing weighing);
  [[nodiscard]] bool worth_refreshing(double decrement);
  [[nodiscard]] DownMessage weigh_all();
  [[nodiscard]] std::vector<std::pair<RobotId, RobotId>> consistent_pairs(
      std::span<const PairPull> pulls) const;

  std::vector<RobotId> members_;
  TreeNewtonOptions options_;
  bool upright_;
  bool again_;
  bool noisy_;  // the odometry of a member, by itself or by cycles through other robots
  RobustSchedule schedule_;
  std::optional<TreeSums> first_;  // sums before any closure was deferred or decided
  bool weakened_ = false;          // odometry, by cycles through other robots
  bool alone_ = false;             // robots have decided the closures inside them
  bool may_defer_ = false;         // closures that stand alone are probably false
  bool deferred_ = false;          // they wait for a second look
  std::uint32_t round_ = 0;
  double barc_ = 0.0;
  double noise_scale_ = 1.0;
  double usual_noise_ = 1.0;
  Precision usual_pair_ = kUnlimited;
  double cost_ = 0.0;
  double decrement_ = 0.0;
  bool free_ = true;
  TreeVerdict::Weighing weighing_ = TreeVerdict::Weighing::kDecided;  // in this round
  bool at_base_ = true;    // the present poses are the accepted ones
  bool full_ = false;      // the second derivatives are full, where possible
  bool convex_ = false;    // full ones were indefinite: no retry until convergence is slow
  bool stale_ = false;     // a step was accepted since the last second derivatives
  bool retried_ = false;   // new second derivatives were tried at these poses
  bool released_ = false;  // pairs that are not contradicted are no longer limited
  int doubts_ = 0;         // number of doubts, see EdgeWeights::doubt()
  bool may_doubt_ = true;  // none yet, or the last one has changed a closure
  int backtracks_ = 0;     // in a row
  double length_ = 1.0;    // scale of the next Newton step; 1 once all is decided
  double refreshed_decrement_ = 0.0;      // when full second derivatives were last due
  std::optional<double> last_decrement_;  // with the present second derivatives
};

}  // namespace km
