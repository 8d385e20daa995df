#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/loop_closure/loop_closure_config.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// A keypoint with its word in place of its descriptor.
struct WordPoint {
  Keypoint keypoint;  ///< With depth.
  std::uint32_t word = 0;
};

/// Keypoints of a keyframe whose words are also those of another keyframe. In a seventh of the
/// bytes of a keyframe's features they show whether the two keyframes can show one place.
struct WordPoints {
  double focal_px = 0.0;
  double baseline_m = 0.0;
  std::vector<WordPoint> points;
};

/// A word that more keypoints of an image have is no help for finding corresponding points.
inline constexpr std::size_t kMaxWordRepeats = 4;

/// Places in `features` of the keypoints with a known depth and a word in `theirs` (ascending),
/// except words of more than kMaxWordRepeats such keypoints. At most `most` places, those of the
/// first keypoints. Ascending by word, then by place.
[[nodiscard]] std::vector<std::size_t> common_word_places(const KeyframeFeatures& features,
                                                          const Vocabulary& vocabulary,
                                                          std::span<const std::uint32_t> theirs,
                                                          std::size_t most);

/// The keypoints at common_word_places(), in their order.
[[nodiscard]] WordPoints common_word_points(const KeyframeFeatures& features,
                                            const Vocabulary& vocabulary,
                                            std::span<const std::uint32_t> theirs,
                                            std::size_t most);

/// Number of points of `theirs` that are where `own` has points of the same words, under the
/// relative pose of the cameras with which most agree (ransac_pose()). Points are pairs if they
/// have the same word, and at most kMaxWordRepeats pairs have this word. Each point counts once.
/// Equal arguments give equal results.
[[nodiscard]] std::size_t agreeing_word_points(const KeyframeFeatures& own,
                                               const Vocabulary& vocabulary,
                                               const WordPoints& theirs,
                                               const LoopClosureConfig& config);

/// Least share of the points of another keyframe that must agree.
inline constexpr double kMinWordShare = 0.07;

/// True if LoopClosureConfig::min_word_points and kMinWordShare of `theirs` agree with `own`. By
/// chance, the number that agree grows with that of the points.
[[nodiscard]] bool may_show_one_place(const KeyframeFeatures& own, const Vocabulary& vocabulary,
                                      const WordPoints& theirs, const LoopClosureConfig& config);

}  // namespace km
