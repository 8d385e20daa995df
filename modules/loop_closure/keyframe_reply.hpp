#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "modules/core/keyframe.hpp"
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

/// Reply to a request for the features of the own keyframe `asked`, with at most `most` keypoints.
/// Those with a known depth and a word of the requester come first. If they are fewer than a
/// quarter of `most`, other keypoints follow, those with depth first: if few words are shared, the
/// two images seldom show one place. For KeyframePart::kDescriptors, the first ones are only
/// descriptors, in the order of common_word_places(). Without `words` all keypoints are equal.
/// Their descriptors are those of the requester's network if it is also that of `asked`, otherwise
/// those of ORB.
///
/// On EuRoC V1_01, 400 keypoints with depth verify 229 pairs. With 200 keypoints, 183 of these
/// pairs are verified if words decide, and 135 otherwise.
[[nodiscard]] KeyframeReply reply_to(const KeyframeRequest& request, const Keyframe& asked,
                                     const std::optional<WordsOfRequester>& words,
                                     std::size_t most);

/// The keyframe of `reply`, with the positions of `points`, which were received before. nullopt if
/// the descriptors of the reply are of other points. `points` may be null.
[[nodiscard]] std::optional<Keyframe> keyframe_of(const KeyframeReply& reply,
                                                  const WordPoints* points);

}  // namespace km
