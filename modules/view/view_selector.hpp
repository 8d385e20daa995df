#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_changes.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/data/robot_sample.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Chooses the next update for viewers from the events of a robot (see JournalEntry), live or from
/// its journal: changes since the last update, the most important first. Not thread-safe.
class ViewSelector {
 public:
  static constexpr double kPosePeriod_s = 0.4;
  /// Time for which keyframes are collected, so that one update has several.
  static constexpr double kKeyframePeriod_s = 1.0;
  /// Maximum size of an update, except for one closure with a long reason.
  static constexpr std::size_t kUpdateBytes = 1000;

  explicit ViewSelector(RobotId self) : self_(self), anchor_(self) {}

  // Inputs from the robot. Values that are not finite are ignored.

  void add(const OdometryState& state);
  void add(const KeyframeOdometry& keyframe);  ///< Own keyframes, ascending.
  void add(const PoseChanges& changes);        ///< Poses of other robots are ignored.
  void add(const ClosureOutcome& outcome);
  void add(const Closure& closure);  ///< Closure verified by one of its ends.
  void add(const ClosureJudgements& judgements);
  void add(const RobotSample& sample) { sample_ = sample; }
  /// Rejects the closures with this robot, because its keyframe indices now mean other keyframes.
  void restarted(RobotId peer);

  /// A viewer has appeared: sends everything again from the beginning.
  void begin_again();
  /// True from begin_again() until everything has been sent once.
  [[nodiscard]] bool sends_past() const { return sends_past_; }

  /// The update to send at `now_s` [s], by any clock that does not go backwards. The update counts
  /// as sent. nullopt if no update is due.
  [[nodiscard]] std::optional<ViewContent> next(double now_s);

 private:
  // A pair of keyframes, from candidate to verdict.
  struct Pair {
    std::uint16_t matches = 0;
    std::uint16_t inliers = 0;
    bool is_known = false;  // False while only a judgement has arrived.
    bool is_verified = false;
    std::string reason;  // Why verification stopped.
    ClosureJudgement judgement = {};
    std::optional<ViewClosure> sent = {};
    std::uint64_t turn = 0;  // Order in the queue; 0 if the pair is not queued.
  };
  // Ordered by rank, then by the time of the change.
  using Turn = std::tuple<int, std::uint64_t, ClosureId>;

  [[nodiscard]] ViewClosure view_of(const ClosureId& id, const Pair& pair) const;
  void look_at(const ClosureId& id, Pair& pair);
  [[nodiscard]] std::optional<ViewContent> next_closures(int max_rank);
  [[nodiscard]] std::optional<ViewContent> next_odometry();
  [[nodiscard]] std::optional<ViewContent> next_optimized();

  RobotId self_;
  std::optional<ViewPose> pose_;  // Pose that has not been sent yet.
  double pose_due_s_ = 0.0;
  double keyframes_due_s_ = 0.0;
  std::vector<SE3> odometry_;  // Poses of the keyframes as estimated by odometry.
  std::vector<Stamp> stamps_;
  std::size_t odometry_sent_ = 0;
  RobotId anchor_;
  std::map<KeyframeIndex, SE3> optimized_;  // In the frame of the anchor.
  std::set<KeyframeIndex> unsent_;          // Optimised poses to send.
  KeyframeIndex cursor_ = 0;                // Index from which the next ones are sent.
  std::optional<RobotSample> sample_;       // Sample that has not been sent yet.
  std::optional<RobotSample> sent_sample_;
  std::map<ClosureId, Pair> pairs_;
  std::set<Turn> waiting_;
  std::uint64_t turn_ = 0;
  bool sends_past_ = false;
};

}  // namespace km
