#pragma once

#include <cstdint>
#include <vector>

namespace km {

/// Sparse TF-IDF vector of one image, of L1 norm 1 (or empty, if no word of the image says
/// anything). words[i] has weight weights[i] > 0; words are strictly ascending.
struct BowVector {
  std::vector<std::uint32_t> words;
  std::vector<float> weights;

  bool operator==(const BowVector&) const = default;
};

/// Similarity of two images in [0, 1]: s(v, w) = 1 - 0.5 * | v/|v| - w/|w| |_1 (Galvez-Lopez and
/// Tardos, "Bags of Binary Words for Fast Place Recognition in Image Sequences", TRO 2012; Nister
/// and Stewenius, CVPR 2006). For vectors of norm 1 without negative entries this is the sum of
/// min(v_i, w_i) over the common words. Linear in the number of words.
[[nodiscard]] double score(const BowVector& v, const BowVector& w);

}  // namespace km
