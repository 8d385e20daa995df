#pragma once

#include <cstdint>
#include <initializer_list>

#include "modules/core/data/keyframe.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// The descriptor that stands for word `word` of toy_vocabulary().
inline BinaryDescriptor toy_descriptor(std::uint32_t word) {
  BinaryDescriptor descriptor{};
  descriptor[word / 8] = static_cast<std::uint8_t>(1U << (word % 8));
  return descriptor;
}

/// `words` (at most 255) words, each one descriptor, all of weight `idf`.
inline Vocabulary toy_vocabulary(std::uint32_t words, float idf = 1.0F) {
  VocabularyData data{.branching = kMaxBranching, .depth = 1};
  data.children.assign(words + 1, 0);
  data.children[0] = static_cast<std::uint8_t>(words);
  data.centers.push_back({});
  for (std::uint32_t word = 0; word < words; ++word) data.centers.push_back(toy_descriptor(word));
  data.idf.assign(words, idf);
  return Vocabulary(std::move(data));
}

/// Vector of equal weights.
inline BowVector toy_vector(std::initializer_list<std::uint32_t> words) {
  return {words, std::vector<float>(words.size(), 1.0F / static_cast<float>(words.size()))};
}

}  // namespace km
