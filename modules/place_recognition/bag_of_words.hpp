#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/core/ids.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// A visual word and its number of occurrences in an image.
struct WordCount {
  std::uint32_t word = 0;
  std::uint32_t count = 0;

  bool operator==(const WordCount&) const = default;
};

/// The visual words of one image: words strictly ascending, counts positive. With the vocabulary,
/// the bag determines the weighted vector exactly, at a fraction of the vector's size.
using BagOfWords = std::vector<WordCount>;

/// The words of one keyframe, as robots send them to each other.
struct KeyframeBow {
  KeyframeId id;
  Stamp stamp = 0;
  std::uint64_t vocabulary = 0;  ///< Vocabulary::id() of the words.
  BagOfWords words;              ///< None if an earlier keyframe shows the place.
  double normalizer = 0.0;       ///< Score against the keyframe before it; 0 if there is none.
};

/// Sparse TF-IDF vector of one image with L1 norm 1. It is empty if no word of the image has a
/// weight. words[i] has weight weights[i] > 0; words are strictly ascending.
struct BowVector {
  std::vector<std::uint32_t> words;
  std::vector<float> weights;

  bool operator==(const BowVector&) const = default;
};

/// Similarity of two images in [0, 1]: s(v, w) = 1 - 0.5 * | v/|v| - w/|w| |_1 (Galvez-Lopez and
/// Tardos, "Bags of Binary Words for Fast Place Recognition in Image Sequences", TRO 2012; Nister
/// and Stewenius, CVPR 2006). For vectors of norm 1 without negative entries this is the sum of
/// min(v_i, w_i) over the common words. Linear in the number of words.
[[nodiscard]] inline double score(const BowVector& v, const BowVector& w) {
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
