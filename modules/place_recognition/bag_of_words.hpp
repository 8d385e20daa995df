#pragma once

#include <cstdint>
#include <vector>

namespace km {

/// How often one visual word occurs in an image.
struct WordCount {
  std::uint32_t word = 0;
  std::uint32_t count = 0;

  bool operator==(const WordCount&) const = default;
};

/// The visual words of one image: words strictly ascending, counts positive. Together with the
/// vocabulary it determines the weighted vector exactly, at a fraction of its size: this is what
/// robots send each other.
using BagOfWords = std::vector<WordCount>;

}  // namespace km
