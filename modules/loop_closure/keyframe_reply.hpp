#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "modules/core/data/keyframe.hpp"
#include "modules/loop_closure/keyframe_requests.hpp"
#include "modules/loop_closure/word_points.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// The words of the keyframe for which a robot requests another one. They indicate corresponding
/// points and cost no bytes, because bags of words are published anyway (Galvez-Lopez and Tardos,
/// TRO 2012, use the same association to save comparisons).
struct WordsOfRequester {
  const Vocabulary& vocabulary;
  std::span<const std::uint32_t> words;  ///< Ascending.
};

/// Number of word points that are sent of a keyframe whose reply has at most `keypoints` keypoints.
/// Most keyframes whose word points are requested show another place, and half of the points shows
/// that as well.
[[nodiscard]] constexpr std::size_t most_word_points(std::size_t keypoints) {
  return keypoints / 2;
}

/// Reply to a request for the features of the own keyframe `asked`, with at most `most` keypoints.
/// Those with a known depth come first, and among them those with a word of the requester. For
/// KeyframePart::kDescriptors, the first ones are only descriptors, in the order of
/// common_word_places(). Without `words` all keypoints with depth are equal. Their descriptors are
/// those of the requester's network if it is also that of `asked`, otherwise those of ORB.
///
/// On EuRoC V1_01, 400 keypoints with depth verify 229 pairs by ORB. With 200 keypoints, 183 of
/// these pairs are verified if words decide, and 135 otherwise.
[[nodiscard]] KeyframeReply reply_to(const KeyframeRequest& request, const Keyframe& asked,
                                     const std::optional<WordsOfRequester>& words,
                                     std::size_t most);

/// The keyframe of `reply`, with the positions of `points`, which were received before. nullopt if
/// the descriptors of the reply are of other points. `points` may be null.
[[nodiscard]] std::optional<Keyframe> keyframe_of(const KeyframeReply& reply,
                                                  const WordPoints* points);

}  // namespace km
