#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// Which words the peers' keyframes have, so that a reply holds what both may see. Of each robot
/// the newest keyframes are kept, as many as have kMaxWordsPerRobot words. Not thread-safe.
class PeerWords {
 public:
  static constexpr std::size_t kMaxWordsPerRobot = 2U << 20U;  ///< 8 MB

  /// `words` ascending; those of a keyframe that is known already are replaced.
  void put(const KeyframeId& id, std::vector<std::uint32_t> words);

  /// Its keyframes are others now.
  void forget(RobotId robot) { robots_.erase(robot); }

  /// nullptr if they are not known (any more). Valid until the next put() or
  /// forget().
  [[nodiscard]] const std::vector<std::uint32_t>* find(const KeyframeId& id) const;

 private:
  struct Robot {
    std::map<KeyframeIndex, std::vector<std::uint32_t>> of_keyframe;
    std::size_t words = 0;
  };
  std::map<RobotId, Robot> robots_;
};

}  // namespace km
