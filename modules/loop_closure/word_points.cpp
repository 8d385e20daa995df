#include "modules/loop_closure/word_points.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "modules/loop_closure/relative_pose.hpp"

namespace km {
namespace {

using PointsOfWords = std::map<std::uint32_t, std::vector<std::size_t>>;

PointsOfWords with_depth(const KeyframeFeatures& features, const Vocabulary& vocabulary) {
  PointsOfWords result;
  const std::vector<std::uint32_t> words = vocabulary.words(features.descriptors);
  for (std::size_t i = 0; i < words.size(); ++i)
    if (features.keypoints[i].has_depth()) result[words[i]].push_back(i);
  return result;
}

// The keypoint after the first `most` keypoints in `points`.
std::size_t end_of_first(const PointsOfWords& points, std::size_t most) {
  std::vector<std::size_t> all;
  for (const auto& [word, of_word] : points) all.insert(all.end(), of_word.begin(), of_word.end());
  if (all.size() <= most) return std::numeric_limits<std::size_t>::max();
  const auto end = all.begin() + static_cast<std::ptrdiff_t>(most);
  std::nth_element(all.begin(), end, all.end());
  return *end;
}

PointsOfWords common(const KeyframeFeatures& features, const Vocabulary& vocabulary,
                     std::span<const std::uint32_t> theirs, std::size_t most) {
  PointsOfWords result = with_depth(features, vocabulary);
  std::erase_if(result, [&](const auto& entry) {
    return entry.second.size() > kMaxWordRepeats ||
           !std::ranges::binary_search(theirs, entry.first);
  });
  const std::size_t end = end_of_first(result, most);
  for (auto& [word, points] : result)
    std::erase_if(points, [&](std::size_t point) { return point >= end; });
  return result;
}

}  // namespace

std::vector<std::size_t> common_word_places(const KeyframeFeatures& features,
                                            const Vocabulary& vocabulary,
                                            std::span<const std::uint32_t> theirs,
                                            std::size_t most) {
  std::vector<std::size_t> places;
  for (const auto& [word, points] : common(features, vocabulary, theirs, most))
    places.insert(places.end(), points.begin(), points.end());
  return places;
}

WordPoints common_word_points(const KeyframeFeatures& features, const Vocabulary& vocabulary,
                              std::span<const std::uint32_t> theirs, std::size_t most) {
  WordPoints result{features.focal_px, features.baseline_m, {}};
  for (const auto& [word, points] : common(features, vocabulary, theirs, most))
    for (const std::size_t point : points)
      result.points.push_back({features.keypoints[point], word});
  return result;
}

std::size_t agreeing_word_points(const KeyframeFeatures& own, const Vocabulary& vocabulary,
                                 const WordPoints& theirs, const LoopClosureConfig& config) {
  KeyframeFeatures other;
  other.focal_px = theirs.focal_px;
  other.baseline_m = theirs.baseline_m;
  PointsOfWords others;
  for (const WordPoint& point : theirs.points) {
    others[point.word].push_back(other.keypoints.size());
    other.keypoints.push_back(point.keypoint);
  }
  const ImageNoise noise;
  std::vector<ImagePair> pairs;
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  for (const auto& [word, points] : with_depth(own, vocabulary)) {
    const auto same = others.find(word);
    if (same == others.end() || points.size() * same->second.size() > kMaxWordRepeats) continue;
    for (const std::size_t a : points)
      for (const std::size_t b : same->second) {
        pairs.push_back({image_point(own, a, noise), image_point(other, b, noise)});
        ends.emplace_back(a, b);
      }
  }
  std::mt19937 rng(config.seed);
  const auto found = ransac_pose(pairs, {}, rng);
  std::set<std::size_t> in_own, in_other;
  for (const std::size_t i : found.inliers) {
    in_own.insert(ends[i].first);
    in_other.insert(ends[i].second);
  }
  return std::min(in_own.size(), in_other.size());
}

bool may_show_one_place(const KeyframeFeatures& own, const Vocabulary& vocabulary,
                        const WordPoints& theirs, const LoopClosureConfig& config) {
  const auto agreeing = static_cast<double>(agreeing_word_points(own, vocabulary, theirs, config));
  return agreeing >= config.min_word_points &&
         agreeing >= kMinWordShare * static_cast<double>(theirs.points.size());
}

}  // namespace km
