#include "modules/loop_closure/peer_words.hpp"

#include <utility>

namespace km {
namespace {

// Memory of a keyframe in words, with the overhead of the map.
std::size_t cost_of(const std::vector<std::uint32_t>& words) {
  constexpr std::size_t kEntry = 32;
  return words.size() + kEntry;
}

}  // namespace

void PeerWords::put(const KeyframeId& id, std::vector<std::uint32_t> words) {
  Robot& robot = robots_[id.robot];
  const auto [known, fresh] = robot.of_keyframe.try_emplace(id.index);
  if (!fresh) robot.words -= cost_of(known->second);
  robot.words += cost_of(words);
  known->second = std::move(words);
  while (robot.words > kMaxWordsPerRobot) {
    robot.words -= cost_of(robot.of_keyframe.begin()->second);
    robot.of_keyframe.erase(robot.of_keyframe.begin());
  }
}

const std::vector<std::uint32_t>* PeerWords::find(const KeyframeId& id) const {
  const auto robot = robots_.find(id.robot);
  if (robot == robots_.end()) return nullptr;
  const auto found = robot->second.of_keyframe.find(id.index);
  return found == robot->second.of_keyframe.end() ? nullptr : &found->second;
}

}  // namespace km
