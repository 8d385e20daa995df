#include "modules/loop_closure/keypoint_choice.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace km {

KeyframeFeatures chosen_by_words(const KeyframeFeatures& features, std::size_t count,
                                 const Vocabulary& vocabulary,
                                 std::span<const std::uint32_t> theirs) {
  if (features.keypoints.size() <= count) return features;
  const std::vector<std::uint32_t> words = vocabulary.words(features.descriptors);
  std::vector<int> rank;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool shared = std::binary_search(theirs.begin(), theirs.end(), words[i]);
    rank.push_back((features.keypoints[i].has_depth() ? 2 : 0) + (shared ? 1 : 0));
  }
  std::vector<std::size_t> order(words.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return rank[a] > rank[b]; });
  order.resize(count);
  KeyframeFeatures chosen = features;
  chosen.keypoints.clear();
  chosen.descriptors.clear();
  for (const std::size_t i : order) {
    chosen.keypoints.push_back(features.keypoints[i]);
    chosen.descriptors.push_back(features.descriptors[i]);
  }
  return chosen;
}

}  // namespace km
