#include "modules/loop_closure/keyframe_reply.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/loop_closure/matching.hpp"

namespace km {
namespace {

// Number of keypoints to send.
struct KeypointBudget {
  std::size_t least = 0;  // lower bound, if there are enough keypoints
  std::size_t most = 0;
};

// As the requester compares it: by its network if that is also ours, otherwise by ORB.
KeyframeFeatures comparable(const KeyframeFeatures& features, std::uint16_t network) {
  KeyframeFeatures result = features;
  result.network = network == features.network ? network : 0;
  result.matched = matched_by(result.network, features);
  return result;
}

KeyframeFeatures chosen_by_words(const KeyframeFeatures& features, const KeypointBudget& budget,
                                 const WordsOfRequester& theirs) {
  if (features.keypoints.size() <= budget.least) return features;
  const std::vector<std::uint32_t> words = theirs.vocabulary.words(features.descriptors);
  std::vector<int> rank;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool shared = std::ranges::binary_search(theirs.words, words[i]);
    rank.push_back((features.keypoints[i].has_depth() ? 2 : 0) + (shared ? 1 : 0));
  }
  std::vector<std::size_t> order(words.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return rank[a] > rank[b]; });
  constexpr int kBest = 3;  // rank of a keypoint with depth and a shared word
  const auto best = static_cast<std::size_t>(std::ranges::count(rank, kBest));
  order.resize(std::min(order.size(), std::clamp(best, budget.least, budget.most)));
  return selected(features, order);
}

KeyframeFeatures without(const KeyframeFeatures& features, std::span<const std::size_t> places) {
  std::vector<bool> is_left(features.keypoints.size(), true);
  for (const std::size_t i : places) is_left[i] = false;
  std::vector<std::size_t> rest;
  for (std::size_t i = 0; i < is_left.size(); ++i)
    if (is_left[i]) rest.push_back(i);
  return selected(features, rest);
}

}  // namespace

KeyframeReply reply_to(const KeyframeRequest& request, const Keyframe& asked,
                       const std::optional<WordsOfRequester>& words, std::size_t most) {
  const KeyframeFeatures features = comparable(asked.features, request.network);
  const KeypointBudget budget{most / 4, most};
  KeyframeReply reply{.number = request.number, .found = true, .keyframe = {}};
  reply.keyframe.odometry = asked.odometry;
  reply.keyframe.stamp = asked.stamp;
  if (!words) {
    reply.keyframe.features = reduced(features, budget.most);
  } else if (request.part != KeyframePart::kDescriptors) {
    reply.keyframe.features = chosen_by_words(features, budget, *words);
  } else {
    const std::vector<std::size_t> points =
        common_word_places(features, words->vocabulary, words->words, budget.most);
    for (const std::size_t point : points) reply.descriptors.push_back(features.matched[point]);
    reply.keyframe.features =
        reduced(without(features, points), budget.least - std::min(budget.least, points.size()));
  }
  reply.keyframe.features.descriptors.clear();
  return reply;
}

std::optional<Keyframe> keyframe_of(const KeyframeReply& reply, const WordPoints* points) {
  Keyframe keyframe = reply.keyframe;
  if (reply.descriptors.empty()) return keyframe;
  if (points == nullptr || points->points.size() != reply.descriptors.size()) return std::nullopt;
  KeyframeFeatures& features = keyframe.features;
  features.focal_px = points->focal_px;
  features.baseline_m = points->baseline_m;
  for (const WordPoint& point : points->points) features.keypoints.push_back(point.keypoint);
  features.matched.insert(features.matched.end(), reply.descriptors.begin(),
                          reply.descriptors.end());
  return keyframe;
}

}  // namespace km
