#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "apps/lab/crowd/recorded_place.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"

namespace km {

inline Vocabulary shipped_vocabulary() {
  return load_vocabulary("config/vocabulary/indoor.kmvoc");
}

/// A place whose keyframes have 200 words of a set of 250 and 100 random ones: similar to each
/// other, and dissimilar to keyframes of other sets.
inline RecordedPlace synthetic_place(std::uint32_t seed, std::size_t keyframes) {
  constexpr std::uint32_t kWords = 8000;
  std::mt19937 random(seed);
  std::vector<std::uint32_t> shared(250);
  for (std::uint32_t& word : shared) word = static_cast<std::uint32_t>(random() % kWords);
  const auto visit = [&] {
    std::vector<BagOfWords> bags(keyframes);
    for (BagOfWords& bag : bags) {
      std::map<std::uint32_t, std::uint32_t> counts;
      std::ranges::shuffle(shared, random);
      for (std::size_t i = 0; i < 200; ++i) ++counts[shared[i]];
      for (std::size_t i = 0; i < 100; ++i) ++counts[static_cast<std::uint32_t>(random() % kWords)];
      for (const auto& [word, count] : counts) bag.push_back({word, count});
    }
    return bags;
  };
  RecordedPlace place;
  place.first = visit();
  place.second = visit();
  return place;
}

}  // namespace km
