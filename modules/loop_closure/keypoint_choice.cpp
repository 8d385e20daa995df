#include "modules/loop_closure/keypoint_choice.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace km {
namespace {

constexpr int kBest = 3;  // with depth, of a shared word

}  // namespace

KeyframeFeatures chosen_by_words(const KeyframeFeatures& features, const KeypointBudget& budget,
                                 const Vocabulary& vocabulary,
                                 std::span<const std::uint32_t> theirs) {
  if (features.keypoints.size() <= budget.least) return features;
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
  const auto best = static_cast<std::size_t>(std::count(rank.begin(), rank.end(), kBest));
  order.resize(std::min(order.size(), std::clamp(best, budget.least, budget.most)));
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
