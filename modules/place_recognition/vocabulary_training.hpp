#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "modules/core/config.hpp"
#include "modules/core/data/keyframe.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// Shape of a vocabulary and the seed of its training.
struct VocabularyTrainingConfig {
  static constexpr const char* kSection = "vocabulary_training";

  /// k: largest number of clusters into which a node is split.
  int branching = 10;

  /// L: largest number of levels below the root; there are at most k^L words.
  int depth = 5;

  /// Seed of the random choice of the first cluster centres.
  std::uint32_t seed = 1;

  void visit_fields(auto& visitor) {
    visitor.field("branching", branching, {2, kMaxBranching});
    visitor.field("depth", depth, {1, kMaxDepth});
    visitor.field("seed", seed, {0U, ~0U});
  }
};

/// Trains a vocabulary: descriptors[i] holds the descriptors of image i.
///
/// Every node's descriptors are split into at most k clusters by k-medians. Centres start by
/// k-means++ (Arthur and Vassilvitskii, SODA 2007; the squared Euclidean distance of binary vectors
/// is their Hamming distance). A centre is the bitwise majority of its cluster (ties: 0). Lloyd's
/// iteration ends when no descriptor changes its cluster or after 20 rounds. A node with at most k
/// different descriptors gets one leaf for each. With N images, n_i of them with word i,
/// idf_i = ln(N / n_i) (Nister and Stewenius, CVPR 2006).
///
/// The same input and seed give the same result on every run. `progress`, if given, is called
/// after each level of the tree with the number of levels done.
/// Throws ConfigError for `config` out of bounds, std::invalid_argument if there is no descriptor.
[[nodiscard]] VocabularyData train_vocabulary(
    std::span<const std::vector<BinaryDescriptor>> descriptors,
    const VocabularyTrainingConfig& config,
    const std::function<void(int levels_done)>& progress = {});

}  // namespace km
