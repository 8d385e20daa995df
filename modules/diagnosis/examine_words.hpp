#pragma once

#include <span>
#include <vector>

#include "modules/diagnosis/examination.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// How well the words of a vocabulary tell the features of these images apart: the number of words
/// that would be as informative if all were as frequent, exp(entropy), against the number of
/// features and of words. Id: vocabulary.coverage.
[[nodiscard]] Examination examine_words(std::span<const std::vector<OrbDescriptor>> images,
                                        const Vocabulary& vocabulary);

}  // namespace km
