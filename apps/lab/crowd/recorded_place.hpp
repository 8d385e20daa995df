#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "modules/place_recognition/bag_of_words.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// Two visits of a recorded place, as the bags of words of their keyframes, equally many.
struct RecordedPlace {
  std::vector<BagOfWords> first;
  std::vector<BagOfWords> second;
};

/// The halves of a recorded sequence that revisits its beginning (kimera_multi_vocabulary bags). An
/// odd keyframe in the middle is left out. Throws std::runtime_error if the file cannot be read,
/// has fewer than four keyframes, or has words that `vocabulary` does not know.
[[nodiscard]] RecordedPlace read_recorded_place(const std::filesystem::path& file,
                                                const Vocabulary& vocabulary);

/// Makes other places of a recorded one: every word is replaced by a word that is about as rare.
///
/// The vocabulary's words in the order of their idf are divided into groups of kGroup, and each
/// place permutes the words inside a group. The sizes of the bags, their frequencies of words, and
/// the similarities of the keyframes of a place then remain nearly those of the recording. Two
/// different places have in common what images of these frequencies have in common by chance.
class PlaceDisguise {
 public:
  static constexpr std::size_t kGroup = 64;

  explicit PlaceDisguise(const Vocabulary& vocabulary);

  /// By word: the word that stands for it at place `place`. Place 0 is the recorded one.
  [[nodiscard]] std::vector<std::uint32_t> words_of(std::uint32_t place) const;

 private:
  std::vector<std::uint32_t> by_idf_;
};

/// `bag` with its words replaced by `words[word]`, a permutation.
[[nodiscard]] BagOfWords disguised(const BagOfWords& bag, const std::vector<std::uint32_t>& words);

}  // namespace km
