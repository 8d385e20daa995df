#include "modules/place_recognition/bag_of_words.hpp"

#include <algorithm>
#include <cstddef>

namespace km {

double score(const BowVector& v, const BowVector& w) {
  double sum = 0.0;
  std::size_t i = 0;
  std::size_t k = 0;
  while (i < v.words.size() && k < w.words.size()) {
    const std::uint32_t a = v.words[i];
    const std::uint32_t b = w.words[k];
    if (a == b) sum += static_cast<double>(std::min(v.weights[i], w.weights[k]));
    i += a <= b ? 1U : 0U;
    k += b <= a ? 1U : 0U;
  }
  return sum;
}

}  // namespace km
