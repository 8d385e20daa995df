#include <algorithm>
#include <cmath>
#include <map>

#include "modules/core/text_table.hpp"
#include "modules/diagnosis/examine_sensors.hpp"

namespace km {

Examination examine_words(std::span<const std::vector<BinaryDescriptor>> images,
                          const Vocabulary& vocabulary) {
  std::map<std::uint32_t, double> counts;
  double features = 0.0;
  for (const std::vector<BinaryDescriptor>& image : images)
    for (const std::uint32_t word : vocabulary.words(image)) {
      ++counts[word];
      ++features;
    }
  constexpr double kEnough = 1000.0;
  if (features < kEnough)
    return {.figures = {{"vocabulary", "not determined: " + fixed(features, 0) + " features"}},
            .findings = {}};
  double entropy = 0.0;
  for (const auto& [word, count] : counts) entropy -= count / features * std::log(count / features);
  const double words = std::exp(entropy);
  const double most = std::min(features, static_cast<double>(vocabulary.size()));
  Examination result;
  result.figures.push_back({"vocabulary", fixed(words, 0) + " words distinguish " +
                                              fixed(features, 0) + " features, of " +
                                              std::to_string(vocabulary.size())});
  constexpr double kLeastWords = 200.0, kLeastShare = 0.05;
  if (words < kLeastWords || words < kLeastShare * most)
    result.findings.push_back(
        {.id = "vocabulary.coverage",
         .severity = Severity::kWarning,
         .what = "the vocabulary distinguishes " + fixed(features, 0) + " features by only " +
                 fixed(words, 0) + " words",
         .means = "different places look alike, so candidates are few or wrong",
         .to_do = "train a vocabulary on images like these: kimera_multi_vocabulary "
                  "train"});
  return result;
}

}  // namespace km
