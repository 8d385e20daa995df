#pragma once

#include <span>
#include <vector>

#include "modules/diagnosis/examination.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// Examines how well the words of a vocabulary distinguish the features of `images`. The measure is
/// exp(entropy), the number of equally frequent words with the same information. It is compared
/// with the numbers of features and of words. Id: vocabulary.coverage.
[[nodiscard]] Examination examine_words(std::span<const std::vector<BinaryDescriptor>> images,
                                        const Vocabulary& vocabulary);

}  // namespace km
