#pragma once

#include <optional>
#include <span>
#include <vector>

#include "modules/pose_graph/robust_schedule.hpp"
#include "modules/pose_graph/tree_front.hpp"
#include "modules/pose_graph/tree_letters.hpp"

namespace km {

struct TreeNewtonOptions {
  int dimension = 3;         ///< 2: poses and measurements are planar.
  double tolerance = 1e-13;  ///< Ends when a step promises less decrease, relative to the cost.
  double absolute_tolerance =
      1e-9;  ///< Or less than this: where nothing contradicts the cost is 0.
  /// Second derivatives are told anew, which costs an elimination and its bytes, when at the rate
  /// seen with the old ones more rounds than this would still be needed.
  double patience_rounds = 30.0;
  std::uint32_t max_rounds = 1000;  ///< Then it ends where it is.
  bool robust = true;               ///< Closures are weighed; else all are trusted.
  double barc = 0.0;             ///< Largest residual of an inlier [sigma]; 0: the team finds it.
  bool reject_odometry = false;  ///< Steps of odometry are weighed, too.
  /// Poses that no closure to another robot ends on may be told as well, where that saves bytes.
  bool tell_private = false;
};

/// What the root of a team's tree decides, round by round, from the sums of the team and its own
/// front, which solves the equations of all. Not thread-safe.
class TreeRoot {
 public:
  /// `members` of the team, ascending.
  TreeRoot(std::vector<RobotId> members, const TreeNewtonOptions& options, bool upright)
      : members_(std::move(members)), options_(options), upright_(upright) {}

  /// Before there are equations: when the team starts, and with which closures.
  [[nodiscard]] DownLetter decide_start(const TreeSums& sums, std::uint32_t round);
  /// After the way up of a round: `front` has the equations at `poses` (of what it follows), unless
  /// they could not be factorised.
  [[nodiscard]] DownLetter decide(const TreeSums& sums, std::uint32_t round, const TreeFront& front,
                                  std::span<const SE3> poses, bool factorised);
  /// A robot could not eliminate with full second derivatives: again with Gauss-Newton's.
  [[nodiscard]] DownLetter retreat(std::uint32_t round);
  /// The team cannot go on.
  [[nodiscard]] DownLetter stop(std::uint32_t round);

 private:
  [[nodiscard]] DownLetter say(TreeVerdict::Next next) const;
  [[nodiscard]] DownLetter start(bool set_aside, const TreeSums& sums);
  [[nodiscard]] DownLetter step(const TreeSums& sums, const TreeFront& front,
                                std::span<const SE3> poses);
  [[nodiscard]] DownLetter go_back();
  [[nodiscard]] DownLetter refresh(bool accept, TreeVerdict::Weighing weighing);
  [[nodiscard]] bool worth_refreshing(double decrement);

  std::vector<RobotId> members_;
  TreeNewtonOptions options_;
  bool upright_;
  RobustSchedule schedule_;
  std::optional<TreeSums> first_;  // before anything was set aside
  std::uint32_t round_ = 0;
  double barc_ = 0.0;
  double noise_scale_ = 1.0;
  Precision usual_pair_ = kUnlimited;
  double cost_ = 0.0;
  double decrement_ = 0.0;
  bool free_ = true;
  TreeVerdict::Weighing weighing_ = TreeVerdict::Weighing::kDecided;  // of the letters at hand
  bool at_base_ = true;   // the poses at hand are the accepted ones
  bool full_ = false;     // second derivatives at hand, where that was possible
  bool convex_ = false;   // the full ones were indefinite: not again until it is slow
  bool stale_ = false;    // a step has been accepted since second derivatives were told
  bool retried_ = false;  // from these poses, with fresh ones
  int backtracks_ = 0;    // in a row
  int rises_ = 0;         // accepted, in a row
  double length_ = 1.0;   // of a step, of Newton's; 1 once all is decided
  std::optional<double> last_decrement_;  // found with the present second derivatives
};

}  // namespace km
