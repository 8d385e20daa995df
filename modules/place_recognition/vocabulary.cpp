#include "modules/place_recognition/vocabulary.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "modules/core/io/bytes.hpp"

namespace km {
namespace {

std::string problem_of_sizes(const VocabularyData& data) {
  const auto outside = [](const char* what, int value, int max) {
    return std::string(what) + ' ' + std::to_string(value) + " is outside [1, " +
           std::to_string(max) + ']';
  };
  if (data.branching < 1 || data.branching > kMaxBranching)
    return outside("branching", data.branching, kMaxBranching);
  if (data.depth < 1 || data.depth > kMaxDepth) return outside("depth", data.depth, kMaxDepth);
  const std::size_t nodes = data.children.size();
  if (nodes < 2 || nodes > kMaxVocabularyNodes)
    return std::to_string(nodes) + " nodes, not in [2, " + std::to_string(kMaxVocabularyNodes) +
           ']';
  if (data.centers.size() != nodes)
    return std::to_string(data.centers.size()) + " centres for " + std::to_string(nodes) + " nodes";
  const auto leaves = std::count(data.children.begin(), data.children.end(), std::uint8_t{0});
  if (data.idf.size() != static_cast<std::size_t>(leaves))
    return std::to_string(data.idf.size()) + " weights for " + std::to_string(leaves) + " words";
  return {};
}

// The children must cover nodes 1 to N-1 exactly once, level by level, none below the depth.
std::string problem_of_tree(const VocabularyData& data) {
  std::size_t next = 1;       // first node that has no parent yet
  std::size_t level_end = 1;  // one past the last node of the current level
  int level = 0;
  for (std::size_t i = 0; i < data.children.size(); ++i) {
    if (i == next) return "node " + std::to_string(i) + " has no parent";
    if (i == level_end) {
      ++level;
      level_end = next;
    }
    const int children = data.children[i];
    if (children == 0) continue;
    if (children > data.branching)
      return "node " + std::to_string(i) + " has " + std::to_string(children) +
             " children, branching is " + std::to_string(data.branching);
    if (level == data.depth)
      return "node " + std::to_string(i) + " at depth " + std::to_string(level) + " has children";
    next += static_cast<std::size_t>(children);
    if (next > data.children.size())
      return "children of node " + std::to_string(i) + " lie beyond the last node";
  }
  if (next != data.children.size()) return "node " + std::to_string(next) + " has no parent";
  return {};
}

}  // namespace

std::string problem_of(const VocabularyData& data) {
  if (std::string problem = problem_of_sizes(data); !problem.empty()) return problem;
  if (std::string problem = problem_of_tree(data); !problem.empty()) return problem;
  for (std::size_t word = 0; word < data.idf.size(); ++word)
    if (!std::isfinite(data.idf[word]) || data.idf[word] < 0.0F)
      return "weight of word " + std::to_string(word) + " is " + std::to_string(data.idf[word]);
  return {};
}

std::uint64_t fingerprint(const VocabularyData& data) {
  static_assert(std::endian::native == std::endian::little, "numbers are mixed as in the file");
  std::uint64_t hash = kFnv1aBasis;
  const auto add = [&hash](std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001B3ULL;
  };
  const auto add_number = [&add](auto number) {
    add(std::bit_cast<std::array<std::uint8_t, sizeof number>>(number));
  };
  add_number(data.branching);
  add_number(data.depth);
  add(data.children);
  for (std::size_t i = 1; i < data.centers.size(); ++i) add(data.centers[i]);
  for (const float idf : data.idf) add_number(idf);
  return hash;
}

std::string fingerprint_text(std::uint64_t fingerprint) {
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4)
    text += "0123456789abcdef"[(fingerprint >> shift) & 0xFU];
  return text;
}

Vocabulary::Vocabulary(VocabularyData data) : data_(std::move(data)) {
  if (const std::string problem = problem_of(data_); !problem.empty())
    throw std::invalid_argument("Vocabulary: " + problem);
  id_ = fingerprint(data_);
  nodes_.reserve(data_.children.size());
  centers_.reserve(data_.children.size());
  std::uint32_t child = 1;
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < data_.children.size(); ++i) {
    const std::uint32_t children = data_.children[i];
    nodes_.push_back({children == 0 ? word++ : child, children});
    child += children;
    centers_.push_back(to_bits(data_.centers[i]));
  }
}

std::vector<std::uint32_t> Vocabulary::words(std::span<const BinaryDescriptor> descriptors) const {
  std::vector<std::uint32_t> result;
  result.reserve(descriptors.size());
  run_counting_bits([&]() __attribute__((always_inline)) {
    for (const BinaryDescriptor& descriptor : descriptors) {
      const DescriptorBits query = to_bits(descriptor);
      Node at = nodes_[0];
      while (at.children != 0)
        at = nodes_[at.first + nearest(query, centers_.data() + at.first, at.children).index];
      result.push_back(at.first);
    }
  });
  return result;
}

BagOfWords Vocabulary::count(std::span<const BinaryDescriptor> descriptors) const {
  std::vector<std::uint32_t> sorted = words(descriptors);
  std::ranges::sort(sorted);
  BagOfWords bag;
  bag.reserve(sorted.size());
  for (const std::uint32_t word : sorted) {
    if (bag.empty() || bag.back().word != word) bag.push_back({word, 0});
    ++bag.back().count;
  }
  return bag;
}

BowVector Vocabulary::weigh(const BagOfWords& bag) const {
  BowVector vector;
  vector.words.reserve(bag.size());
  vector.weights.reserve(bag.size());
  double norm = 0.0;
  for (const auto& [word, count] : bag) {
    const float weight = static_cast<float>(count) * data_.idf[word];
    if (weight == 0.0F) continue;
    vector.words.push_back(word);
    vector.weights.push_back(weight);
    norm += static_cast<double>(weight);
  }
  const auto scale = static_cast<float>(1.0 / norm);
  for (float& weight : vector.weights) weight *= scale;
  return vector;
}

BowVector Vocabulary::transform(std::span<const BinaryDescriptor> descriptors) const {
  return weigh(count(descriptors));
}

bool Vocabulary::knows(const BagOfWords& bag) const {
  return bag.empty() || bag.back().word < size();  // ascending
}

}  // namespace km
