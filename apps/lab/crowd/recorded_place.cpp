#include "apps/lab/crowd/recorded_place.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <stdexcept>
#include <utility>

#include "modules/place_recognition/bag_file.hpp"

namespace km {

RecordedPlace read_recorded_place(const std::filesystem::path& file, const Vocabulary& vocabulary) {
  std::vector<BagOfWords> bags = read_bags(file);
  const std::size_t half = bags.size() / 2;
  if (half < 2) throw std::runtime_error(file.string() + ": fewer than four keyframes");
  if (!std::ranges::all_of(bags, [&](const BagOfWords& bag) { return vocabulary.knows(bag); }))
    throw std::runtime_error(file.string() + ": has words that the vocabulary does not know");
  const auto end = bags.begin() + static_cast<std::ptrdiff_t>(half);
  return {.first = {bags.begin(), end},
          .second = {bags.end() - static_cast<std::ptrdiff_t>(half), bags.end()}};
}

PlaceDisguise::PlaceDisguise(const Vocabulary& vocabulary) : by_idf_(vocabulary.size()) {
  std::iota(by_idf_.begin(), by_idf_.end(), 0U);
  const std::vector<float>& idf = vocabulary.data().idf;
  std::ranges::stable_sort(by_idf_, {}, [&](std::uint32_t word) { return idf[word]; });
}

std::vector<std::uint32_t> PlaceDisguise::words_of(std::uint32_t place) const {
  std::vector<std::uint32_t> words(by_idf_.size());
  std::vector<std::uint32_t> shuffled = by_idf_;
  std::mt19937 random(place);
  for (std::size_t begin = 0; place > 0 && begin < shuffled.size(); begin += kGroup) {
    const std::size_t end = std::min(begin + kGroup, shuffled.size());
    for (std::size_t i = end - 1; i > begin; --i)  // Fisher and Yates
      std::swap(shuffled[i], shuffled[begin + random() % (i - begin + 1)]);
  }
  for (std::size_t i = 0; i < words.size(); ++i) words[by_idf_[i]] = shuffled[i];
  return words;
}

BagOfWords disguised(const BagOfWords& bag, const std::vector<std::uint32_t>& words) {
  BagOfWords other = bag;
  for (WordCount& entry : other) entry.word = words[entry.word];
  std::ranges::sort(other, {}, &WordCount::word);
  return other;
}

}  // namespace km
