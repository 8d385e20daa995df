#pragma once

#include <map>
#include <optional>
#include <span>

#include "modules/core/data/covariance.hpp"
#include "modules/core/data/pose_graph.hpp"

namespace km {

/// How a keyframe of this robot relates to its earlier ones.
enum class PlaceNovelty {
  kNew,      ///< Shows a place that no earlier keyframe shows, as far as is known.
  kKnown,    ///< Shows the place of an earlier keyframe, and a further closure to it is due.
  kCovered,  ///< Shows the place of an earlier keyframe, and a closure of late ties it to it.
};

/// Recognises keyframes of this robot that show a known place: the robot has an earlier keyframe
/// from nearly the same pose. The words of such a keyframe add nothing to those of the earlier one:
/// other robots find the place by either. They cost bytes and memory for as long as the robot
/// moves.
///
/// The pose relative to the earlier keyframe follows from the newest verified closure inside this
/// robot, and odometry between the ends of the closure and the two keyframes. A place is known if
/// this pose is certain and near, and if the two keyframes also have similar words. The robot has
/// to verify a closure again after kFreshKeyframes; without one, places count as new after
/// kValidKeyframes. Not thread-safe.
class KnownPlaces {
 public:
  static constexpr KeyframeIndex kFreshKeyframes = 4;
  static constexpr KeyframeIndex kValidKeyframes = 40;
  static constexpr double kReach_depths = 0.15;  ///< Distance of near poses, in median depths.
  static constexpr double kTurn_rad = 0.35;      ///< Rotation between near poses.
  /// Standard deviations (root of the sum over three axes) of a certain pose, as a share of the two
  /// bounds above.
  static constexpr double kSigma_share = 0.5;

  /// Adds a keyframe whose place is new. `median_depth_m`: median depth of its keypoints, 0 if
  /// unknown; its place is then never known.
  void add_view(const OdometryPose& keyframe, double median_depth_m);

  /// Notes a verified closure between two keyframes of this robot. A closure with a keyframe that
  /// has no depth is ignored: it is that with a finished map, whose keyframe is no view of this
  /// run.
  void add_closure(const Closure& closure);

  /// Whether the place of `keyframe` is known. `similar`: earlier keyframes with similar words.
  [[nodiscard]] PlaceNovelty novelty_of(const OdometryPose& keyframe,
                                        std::span<const KeyframeIndex> similar) const;

 private:
  struct View {
    OdometryPose odometry;
    double median_depth_m = 0.0;
  };
  /// A closure, from the earlier to the later keyframe.
  struct Tie {
    OdometryPose early, late;
    UncertainPose T_early_late;
  };

  std::map<KeyframeIndex, View> views_;
  std::optional<Tie> tie_;  // the one with the newest `late`
};

}  // namespace km
