#include "modules/place_recognition/vocabulary_data.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <span>

namespace km {
namespace {

class Fnv1a {
 public:
  void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) hash_ = (hash_ ^ byte) * 0x100000001B3ULL;
  }
  void add(std::uint32_t value) {  // little-endian
    for (int shift = 0; shift < 32; shift += 8) {
      const auto byte = static_cast<std::uint8_t>(value >> shift);
      add({&byte, 1});
    }
  }
  std::uint64_t hash() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325ULL;
};

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
  Fnv1a hash;
  hash.add(static_cast<std::uint32_t>(data.branching));
  hash.add(static_cast<std::uint32_t>(data.depth));
  hash.add(data.children);
  for (std::size_t i = 1; i < data.centers.size(); ++i) hash.add(data.centers[i]);
  for (const float idf : data.idf) hash.add(std::bit_cast<std::uint32_t>(idf));
  return hash.hash();
}

std::string fingerprint_text(std::uint64_t fingerprint) {
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4)
    text += "0123456789abcdef"[(fingerprint >> shift) & 0xFU];
  return text;
}

}  // namespace km
