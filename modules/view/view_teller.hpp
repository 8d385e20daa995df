#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "modules/core/closure_verdicts.hpp"
#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// What of all that a robot knows is to be told next, so that those who watch know it, too: what
/// has changed since it was told, the most important first. Poses are told anew once they are off
/// by more than kMaxShift_m or kMaxTurn_rad from what was told: when nothing is left to be told,
/// what was told is within these. Not thread-safe.
class ViewTeller {
 public:
  static constexpr double kMaxShift_m = 0.01;
  static constexpr double kMaxTurn_rad = 0.5 / kDegrees;
  static constexpr double kPosePeriod_s = 0.4;
  /// Keyframes are collected for so long, so that one update has several.
  static constexpr double kKeyframePeriod_s = 1.0;
  /// An update is not longer than this, but for one closure with a long reason.
  static constexpr std::size_t kUpdateBytes = 1000;

  explicit ViewTeller(RobotId self) : self_(self) {}

  // What the robot knows. What is not finite is left out.

  void add(const OdometryState& state);
  void add(const KeyframeOdometry& keyframe);              ///< Own ones, ascending.
  void add(std::shared_ptr<const Trajectory> trajectory);  ///< Own, the newest counts.
  void add(const ClosureOutcome& outcome);
  void add(const Closure& closure);           ///< Verified by one of its ends.
  void add(const InlierSet& set);             ///< The newest version of a pair counts.
  void add(const ClosureVerdicts& verdicts);  ///< Of each closure the latest counts.
  /// Keyframes of this robot are others from now on: closures with them are no more.
  void restarted(RobotId peer);

  /// Somebody has come: all is told again from the beginning.
  void begin_again();
  /// True from then on until all that there is has been told once.
  [[nodiscard]] bool tells_past() const { return tells_past_; }

  /// What is to be told now, at `now_s` [s] of any clock that does not go backwards; it counts as
  /// told. nullopt: nothing, for now.
  [[nodiscard]] std::optional<ViewContent> next(double now_s);

 private:
  // A pair of keyframes, from candidate to verdict.
  struct Pair {
    std::uint16_t matches = 0;
    std::uint16_t inliers = 0;
    bool is_verified = false;
    std::string reason;  // why verification stopped
    std::optional<ViewClosure> told = {};
    std::uint64_t turn = 0;  // in which it waits; 0: it does not
  };
  // By rank, then in the order of changes.
  using Turn = std::tuple<int, std::uint64_t, ClosureId>;

  [[nodiscard]] ViewClosure view_of(const ClosureId& id, const Pair& pair) const;
  void look_at(const ClosureId& id, Pair& pair);
  [[nodiscard]] std::optional<ViewContent> next_closures(int max_rank);
  [[nodiscard]] std::optional<ViewContent> next_odometry();
  [[nodiscard]] std::optional<ViewContent> next_optimized();
  [[nodiscard]] std::optional<ViewContent> next_moved();

  RobotId self_;
  std::optional<ViewPose> pose_;  // not told yet
  double pose_due_s_ = 0.0;
  double keyframes_due_s_ = 0.0;
  std::vector<SE3> odometry_;  // of the keyframes
  std::vector<Stamp> stamps_;
  std::size_t odometry_told_ = 0;
  std::shared_ptr<const Trajectory> trajectory_;
  std::vector<SE3> optimized_told_;  // in the frame of the trajectory's anchor
  std::size_t cursor_ = 0;           // where to look for moved ones
  bool any_moved_ = false;           // perhaps
  std::map<ClosureId, Pair> pairs_;
  std::map<std::pair<RobotId, RobotId>, InlierSet> inlier_sets_;
  std::set<ClosureId> overruled_;  // by the optimiser
  std::set<Turn> waiting_;
  std::uint64_t turn_ = 0;
  bool tells_past_ = false;
};

}  // namespace km
