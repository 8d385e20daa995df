#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "modules/core/keyframe.hpp"

namespace km {

/// A vocabulary tree as it is trained and stored. Node 0 is the root; the others follow in
/// breadth-first order, so that the children of a node are consecutive and follow those of the
/// nodes before it. The leaves are the words, numbered in this order.
struct VocabularyData {
  int branching = 0;                        ///< k: no node has more children.
  int depth = 0;                            ///< L: no leaf lies deeper (the root has depth 0).
  std::vector<std::uint8_t> children = {};  ///< Number of children per node, 0 for a leaf.
  std::vector<OrbDescriptor> centers = {};  ///< Per node; the root's has no meaning (zero).
  std::vector<float> idf = {};              ///< Inverse document frequency per word, >= 0.

  bool operator==(const VocabularyData&) const = default;
};

inline constexpr int kMaxBranching = 255;
inline constexpr int kMaxDepth = 16;
inline constexpr std::uint32_t kMaxVocabularyNodes = 1U << 26U;

/// Why `data` is no vocabulary ("node 17 has 12 children, branching is 10"), or empty.
[[nodiscard]] std::string problem_of(const VocabularyData& data);

/// Identity of a vocabulary: 64-bit FNV-1a over branching, depth, children, centres and idf, in the
/// bytes of the file.
[[nodiscard]] std::uint64_t fingerprint(const VocabularyData& data);

/// A fingerprint as people compare it: 16 hexadecimal digits.
[[nodiscard]] std::string fingerprint_text(std::uint64_t fingerprint);

}  // namespace km
