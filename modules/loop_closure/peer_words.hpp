#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// Words of the peers' keyframes, so that a reply contains points that both keyframes may show.
/// Keeps the newest keyframes of each robot, up to kMaxWordsPerRobot words. Not thread-safe.
class PeerWords {
 public:
  /// 8 MB. The overhead of a keyframe counts as 32 words.
  static constexpr std::size_t kMaxWordsPerRobot = 2U << 20U;

  /// Stores the ascending `words` of a keyframe, in place of former words of this keyframe.
  void put(const KeyframeId& id, std::vector<std::uint32_t> words);

  /// Removes the words of a robot, because its keyframe indices now mean other keyframes.
  void forget(RobotId robot) { robots_.erase(robot); }

  /// The words of a keyframe; nullptr if not stored (any more). The pointer is valid until the next
  /// change of the stored words.
  [[nodiscard]] const std::vector<std::uint32_t>* find(const KeyframeId& id) const;

 private:
  struct Robot {
    std::map<KeyframeIndex, std::vector<std::uint32_t>> of_keyframe;
    std::size_t words = 0;
  };
  std::map<RobotId, Robot> robots_;
};

}  // namespace km
