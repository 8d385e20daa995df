#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// Words of the peers' keyframes, so that a reply contains points that both keyframes may show. For
/// each robot it keeps the newest keyframes that have kMaxWordsPerRobot words together. Not
/// thread-safe.
class PeerWords {
 public:
  static constexpr std::size_t kMaxWordsPerRobot = 2U << 20U;  ///< 8 MB

  /// `words` are ascending; they replace those of a known keyframe.
  void put(const KeyframeId& id, std::vector<std::uint32_t> words);

  /// Removes the words of a robot, because its keyframe indices now mean other keyframes.
  void forget(RobotId robot) { robots_.erase(robot); }

  /// nullptr if the words are not known (any more). Valid until the next put(), or until the robot
  /// is removed.
  [[nodiscard]] const std::vector<std::uint32_t>* find(const KeyframeId& id) const;

 private:
  struct Robot {
    std::map<KeyframeIndex, std::vector<std::uint32_t>> of_keyframe;
    std::size_t words = 0;
  };
  std::map<RobotId, Robot> robots_;
};

}  // namespace km
