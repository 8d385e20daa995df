#include "apps/lab/crowd/sketch_index.hpp"

#include <algorithm>

namespace km {

std::vector<SketchMatch> SketchIndex::add(const KeyframeId& keyframe, const BowVector& sketch) {
  if (known_.contains(keyframe)) return {};
  std::vector<SketchMatch> matches = search(keyframe.robot, sketch);
  database_.add(sketch);
  entries_.push_back({keyframe});
  known_.insert(keyframe);
  return matches;
}

std::vector<SketchMatch> SketchIndex::search(RobotId robot, const BowVector& sketch) const {
  std::vector<SketchMatch> named;
  const BowMatches found = database_.query(sketch, {.min_score = bounds_.min_score});
  for (const BowMatch& match : found.best) {
    if (named.size() == bounds_.max_robots) break;
    const auto& [keyframe, ignored] = entries_[match.index];
    const bool is_named = std::ranges::any_of(
        named, [&](const SketchMatch& other) { return other.keyframe.robot == keyframe.robot; });
    if (ignored || is_named || keyframe.robot == robot) continue;
    named.push_back({keyframe, static_cast<double>(match.score)});
  }
  return named;
}

void SketchIndex::forget(RobotId robot) {
  for (Entry& entry : entries_) entry.ignored |= entry.keyframe.robot == robot;
  std::erase_if(known_, [&](const KeyframeId& keyframe) { return keyframe.robot == robot; });
}

}  // namespace km
