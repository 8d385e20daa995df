#include "modules/place_recognition/vocabulary_training.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>

#include "modules/place_recognition/hamming.hpp"

namespace km {
namespace {

constexpr int kMaxRounds = 20;  // rounds of Lloyd's iteration; few nodes need more than ten

// Counts how many descriptors have each bit set.
class BitCounter {
 public:
  void add(const DescriptorBits& bits) {
    for (std::size_t i = 0; i < counts_.size(); ++i)
      counts_[i] += static_cast<std::uint32_t>((bits.word[i / 64] >> (i % 64)) & 1U);
    ++total_;
  }

  // Bits set in more than half of the descriptors.
  DescriptorBits majority() const {
    DescriptorBits bits;
    for (std::size_t i = 0; i < counts_.size(); ++i)
      if (2 * std::uint64_t{counts_[i]} > total_) bits.word[i / 64] |= std::uint64_t{1} << (i % 64);
    return bits;
  }

  bool empty() const { return total_ == 0; }

 private:
  std::array<std::uint32_t, 256> counts_{};
  std::uint64_t total_ = 0;
};

// Up to k different centres. Each further centre is drawn with a probability proportional to its
// distance from the nearest former centre. There are fewer than k if the points have fewer
// different descriptors.
std::vector<DescriptorBits> spread_centers(std::span<const DescriptorBits> points, int k,
                                           std::mt19937& rng) {
  std::uniform_int_distribution<std::size_t> uniform(0, points.size() - 1);
  std::vector<DescriptorBits> centers{points[uniform(rng)]};
  std::vector<std::uint32_t> distance(points.size(), ~0U);
  while (static_cast<int>(centers.size()) < k) {
    const std::vector<NearestBits> newest = nearest_of_each(points, {&centers.back(), 1});
    std::uint64_t total = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      distance[i] = std::min(distance[i], newest[i].distance);
      total += distance[i];
    }
    if (total == 0) break;
    std::uint64_t left = std::uniform_int_distribution<std::uint64_t>(0, total - 1)(rng);
    std::size_t chosen = 0;
    while (left >= distance[chosen]) left -= distance[chosen++];
    centers.push_back(points[chosen]);
  }
  return centers;
}

struct Clustering {
  std::vector<DescriptorBits> centers;
  std::vector<NearestBits> of_point;
};

Clustering cluster(std::span<const DescriptorBits> points, int k, std::mt19937& rng) {
  Clustering result{spread_centers(points, k, rng), {}};
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<NearestBits> assigned = nearest_of_each(points, result.centers);
    const bool settled =
        std::equal(assigned.begin(), assigned.end(), result.of_point.begin(), result.of_point.end(),
                   [](const auto& a, const auto& b) { return a.index == b.index; });
    result.of_point = std::move(assigned);
    if (settled) break;
    std::vector<BitCounter> counters(result.centers.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      counters[result.of_point[i].index].add(points[i]);
    for (std::size_t c = 0; c < counters.size(); ++c)
      if (!counters[c].empty()) result.centers[c] = counters[c].majority();
  }
  // The last allowed round also ends with an assignment to its centres.
  result.of_point = nearest_of_each(points, result.centers);
  return result;
}

// The descriptors of one node: a range of the array that training reorders.
struct Cluster {
  std::size_t begin;
  std::size_t end;
  DescriptorBits center;
};

// Splits `parent` and groups its points by cluster. Empty if there is nothing to split.
std::vector<Cluster> split(const Cluster& parent, std::vector<DescriptorBits>& points, int k,
                           std::mt19937& rng) {
  const std::span<DescriptorBits> own(points.data() + parent.begin, parent.end - parent.begin);
  const Clustering clusters = cluster(own, k, rng);
  std::vector<std::vector<DescriptorBits>> members(clusters.centers.size());
  for (std::size_t i = 0; i < own.size(); ++i)
    members[clusters.of_point[i].index].push_back(own[i]);
  std::vector<Cluster> children;
  std::size_t begin = parent.begin;
  for (std::size_t c = 0; c < members.size(); ++c) {
    if (members[c].empty()) continue;
    std::copy(members[c].begin(), members[c].end(),
              points.begin() + static_cast<std::ptrdiff_t>(begin));
    children.push_back({begin, begin + members[c].size(), clusters.centers[c]});
    begin += members[c].size();
  }
  if (children.size() < 2) children.clear();
  return children;
}

std::vector<DescriptorBits> gather(std::span<const std::vector<BinaryDescriptor>> descriptors) {
  std::vector<DescriptorBits> points;
  for (const auto& image : descriptors)
    for (const BinaryDescriptor& descriptor : image) points.push_back(to_bits(descriptor));
  if (points.empty()) throw std::invalid_argument("train_vocabulary: no descriptors");
  return points;
}

std::vector<float> inverse_document_frequencies(
    const VocabularyData& tree, std::span<const std::vector<BinaryDescriptor>> descriptors) {
  const Vocabulary vocabulary(tree);
  std::vector<std::uint32_t> images_with(vocabulary.size(), 0);
  for (const auto& image : descriptors)
    for (const WordCount& entry : vocabulary.count(image)) ++images_with[entry.word];
  std::vector<float> idf;
  idf.reserve(vocabulary.size());
  const auto images = static_cast<double>(descriptors.size());
  // n is 0 if all descriptors of a leaf's cluster descend to other leaves.
  for (const std::uint32_t n : images_with)
    idf.push_back(static_cast<float>(std::log(images / std::max(1U, n))));
  return idf;
}

}  // namespace

VocabularyData train_vocabulary(std::span<const std::vector<BinaryDescriptor>> descriptors,
                                const VocabularyTrainingConfig& config,
                                const std::function<void(int)>& progress) {
  VocabularyData data{.branching = checked(config).branching, .depth = config.depth};
  std::vector<DescriptorBits> points = gather(descriptors);
  std::mt19937 rng(config.seed);
  data.centers.push_back({});
  std::vector<Cluster> level{{0, points.size(), {}}};
  for (int depth = 0; depth < config.depth; ++depth) {
    std::vector<Cluster> next;
    for (const Cluster& node : level) {
      const std::vector<Cluster> children = split(node, points, config.branching, rng);
      data.children.push_back(static_cast<std::uint8_t>(children.size()));
      next.insert(next.end(), children.begin(), children.end());
    }
    for (const Cluster& child : next) data.centers.push_back(to_descriptor(child.center));
    level = std::move(next);
    if (progress) progress(depth + 1);
  }
  data.children.resize(data.centers.size(), 0);  // the last level
  if (data.centers.size() < 2)
    throw std::invalid_argument("train_vocabulary: all descriptors are equal");
  const auto leaves = std::count(data.children.begin(), data.children.end(), std::uint8_t{0});
  data.idf.assign(static_cast<std::size_t>(leaves), 0.0F);
  data.idf = inverse_document_frequencies(data, descriptors);
  return data;
}

}  // namespace km
