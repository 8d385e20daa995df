#pragma once

#include <map>

#include "modules/core/ids.hpp"

namespace km {

/// Decides whether a robot that owners of words have named for a keyframe is worth a bag of words:
/// only if it has been named for another keyframe shortly before.
///
/// Robots at a common place are named again and again. Other robots are named by chance, the more
/// often the larger the team. That the same robot is named by chance twice within a few keyframes
/// becomes less likely in larger teams. The rule is the temporal consistency of candidates
/// (Galvez-Lopez and Tardos, "Bags of Binary Words for Fast Place Recognition in Image Sequences",
/// TRO 2012), between robots.
class RepeatedNames {
 public:
  /// `window`: largest distance of the two keyframes; 0: every name counts.
  explicit RepeatedNames(KeyframeIndex window) : window_(window) {}

  /// Notes that `robot` was named for the own keyframe `keyframe`. True if it was named for another
  /// keyframe at most `window` before. Keyframes must not decrease.
  [[nodiscard]] bool add(RobotId robot, KeyframeIndex keyframe) {
    const auto [named, is_new] = newest_.try_emplace(robot, keyframe);
    if (is_new) return window_ == 0;
    const KeyframeIndex before = named->second;
    named->second = keyframe;
    return window_ == 0 || keyframe - before <= window_;
  }

  /// Drops a robot, because its keyframe indices now mean other keyframes.
  void forget(RobotId robot) { newest_.erase(robot); }

 private:
  KeyframeIndex window_;
  std::map<RobotId, KeyframeIndex> newest_;  // newest keyframe for which a robot was named
};

}  // namespace km
