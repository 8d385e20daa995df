#include "modules/loop_closure/keyframe_reply.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "modules/loop_closure/keyframe_features.hpp"
#include "modules/loop_closure/matching.hpp"

namespace km {
namespace {

// As the requester compares it: by its network if that is also ours, otherwise by ORB.
KeyframeFeatures comparable(const KeyframeFeatures& features, std::uint16_t network) {
  KeyframeFeatures result = features;
  result.network = network == features.network ? network : 0;
  result.matched = matched_by(result.network, features);
  return result;
}

// The first `most` keypoints by rank: with depth before without, and then of the requester's words
// before others.
KeyframeFeatures chosen_by_words(const KeyframeFeatures& features, std::size_t most,
                                 const WordsOfRequester& theirs) {
  if (features.keypoints.size() <= most) return features;
  const std::vector<std::uint32_t> words = theirs.vocabulary.words(features.descriptors);
  std::vector<int> rank;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool shared = std::ranges::binary_search(theirs.words, words[i]);
    rank.push_back((features.keypoints[i].has_depth() ? 2 : 0) + (shared ? 1 : 0));
  }
  std::vector<std::size_t> order(words.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return rank[a] > rank[b]; });
  order.resize(most);
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
  KeyframeReply reply{.number = request.number, .found = true, .keyframe = {}};
  reply.keyframe.odometry = asked.odometry;
  reply.keyframe.stamp = asked.stamp;
  if (!words) {
    reply.keyframe.features = reduced(features, most);
  } else if (request.part != KeyframePart::kDescriptors) {
    reply.keyframe.features = chosen_by_words(features, most, *words);
  } else {
    const std::vector<std::size_t> points =
        common_word_places(features, words->vocabulary, words->words, most_word_points(most));
    for (const std::size_t point : points) reply.descriptors.push_back(features.matched[point]);
    reply.keyframe.features =
        chosen_by_words(without(features, points), most - points.size(), *words);
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
