#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "modules/core/data/keyframe.hpp"
#include "modules/place_recognition/bag_of_words.hpp"
#include "modules/place_recognition/hamming.hpp"

namespace km {

/// A vocabulary tree as it is trained and stored. Node 0 is the root; the others follow in
/// breadth-first order, so that the children of a node are consecutive and follow those of the
/// nodes before it. The leaves are the words, numbered in this order.
struct VocabularyData {
  int branching = 0;                           ///< k: no node has more children.
  int depth = 0;                               ///< L: no leaf lies deeper (the root has depth 0).
  std::vector<std::uint8_t> children = {};     ///< Number of children per node, 0 for a leaf.
  std::vector<BinaryDescriptor> centers = {};  ///< Cluster centre per node; zero for the root.
  std::vector<float> idf = {};                 ///< Inverse document frequency per word, >= 0.

  bool operator==(const VocabularyData&) const = default;
};

inline constexpr int kMaxBranching = 255;
inline constexpr int kMaxDepth = 16;
inline constexpr std::uint32_t kMaxVocabularyNodes = 1U << 26U;

/// Reason why `data` is no vocabulary ("node 17 has 12 children, branching is 10"), or empty.
[[nodiscard]] std::string problem_of(const VocabularyData& data);

/// Identity of a vocabulary: 64-bit FNV-1a over branching, depth, children, centres and idf, in the
/// bytes of the file.
[[nodiscard]] std::uint64_t fingerprint(const VocabularyData& data);

/// A fingerprint as 16 hexadecimal digits.
[[nodiscard]] std::string fingerprint_text(std::uint64_t fingerprint);

/// Tree that assigns a visual word to a binary descriptor (Nister and Stewenius, "Scalable
/// Recognition with a Vocabulary Tree", CVPR 2006, with the binary medians of Galvez-Lopez and
/// Tardos, TRO 2012). A descriptor descends from the root to the nearest child until it reaches a
/// leaf, with at most k * L distances. Immutable, hence thread-safe.
class Vocabulary {
 public:
  /// Throws std::invalid_argument with problem_of(data) if `data` is no vocabulary.
  explicit Vocabulary(VocabularyData data);

  /// Identity: vectors of vocabularies with different ids cannot be compared.
  std::uint64_t id() const { return id_; }

  /// Number of words.
  std::size_t size() const { return data_.idf.size(); }

  const VocabularyData& data() const { return data_; }

  /// The word of each descriptor, in order.
  std::vector<std::uint32_t> words(std::span<const BinaryDescriptor> descriptors) const;

  /// The words of an image and how often each occurs.
  BagOfWords count(std::span<const BinaryDescriptor> descriptors) const;

  /// TF-IDF: weight of word i = count_i * idf_i, scaled to L1 norm 1. Words without weight (those
  /// in every training image) are omitted. Precondition: words below size(), see knows().
  BowVector weigh(const BagOfWords& bag) const;

  /// weigh(count(descriptors)).
  BowVector transform(std::span<const BinaryDescriptor> descriptors) const;

  /// True if every word of `bag` is one of this vocabulary.
  bool knows(const BagOfWords& bag) const;

 private:
  VocabularyData data_;
  std::uint64_t id_ = 0;
  struct Node {
    std::uint32_t first;     // index of the first child; of a leaf: its word
    std::uint32_t children;  // 0 for a leaf
  };
  std::vector<Node> nodes_;
  std::vector<DescriptorBits> centers_;  // centres of nodes_, for the descent
};

}  // namespace km
