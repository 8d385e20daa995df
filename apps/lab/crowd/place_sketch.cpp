#include "apps/lab/crowd/place_sketch.hpp"

#include <algorithm>
#include <numeric>

namespace km {

std::vector<std::uint32_t> heaviest_words(const BowVector& image, std::size_t count) {
  std::vector<std::size_t> order(image.words.size());
  std::iota(order.begin(), order.end(), 0U);
  const std::size_t kept = std::min(count, order.size());
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(kept);
  std::partial_sort(order.begin(), end, order.end(), [&](std::size_t a, std::size_t b) {
    return image.weights[a] != image.weights[b] ? image.weights[a] > image.weights[b] : a < b;
  });
  order.resize(kept);
  std::ranges::sort(order);
  std::vector<std::uint32_t> words;
  for (const std::size_t i : order) words.push_back(image.words[i]);
  return words;
}

BagOfWords sketch_of(const BagOfWords& bag, const BowVector& image, std::size_t count) {
  const std::vector<std::uint32_t> heaviest = heaviest_words(image, count);
  BagOfWords sketch;
  std::ranges::copy_if(bag, std::back_inserter(sketch), [&](const WordCount& entry) {
    return std::ranges::binary_search(heaviest, entry.word);
  });
  return sketch;
}

}  // namespace km
