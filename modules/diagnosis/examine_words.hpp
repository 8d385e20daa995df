#pragma once

#include <span>
#include <vector>

#include "modules/diagnosis/examination.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// How well the words of a vocabulary distinguish the features of these images. The measure is the
/// number of equally frequent words that would be as informative, exp(entropy), relative to the
/// number of features and of words. Id: vocabulary.coverage.
[[nodiscard]] Examination examine_words(std::span<const std::vector<OrbDescriptor>> images,
                                        const Vocabulary& vocabulary);

}  // namespace km
