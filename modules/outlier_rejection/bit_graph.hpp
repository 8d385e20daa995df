#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace km {

/// Set of integers below a fixed capacity, one bit each. Binary operations expect equal capacities.
class BitSet {
 public:
  explicit BitSet(std::size_t capacity = 0) : words_((capacity + 63) / 64, 0) {}

  void insert(std::size_t i) { words_[i / 64] |= std::uint64_t{1} << (i % 64); }
  void erase(std::size_t i) { words_[i / 64] &= ~(std::uint64_t{1} << (i % 64)); }
  [[nodiscard]] bool contains(std::size_t i) const {
    return (words_[i / 64] >> (i % 64) & 1U) != 0;
  }

  /// The smallest element that is at least `from`.
  [[nodiscard]] std::optional<std::size_t> next(std::size_t from) const {
    std::size_t w = from / 64;
    if (w >= words_.size()) return std::nullopt;
    std::uint64_t word = words_[w] & (~std::uint64_t{0} << (from % 64));
    while (word == 0) {
      if (++w == words_.size()) return std::nullopt;
      word = words_[w];
    }
    return 64 * w + static_cast<std::size_t>(std::countr_zero(word));
  }

  void clear() { std::fill(words_.begin(), words_.end(), 0); }
  void grow(std::size_t capacity) { words_.resize((capacity + 63) / 64, 0); }

  void subtract(const BitSet& other) {
    for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= ~other.words_[w];
  }
  void assign_intersection(const BitSet& x, const BitSet& y) {
    words_.resize(x.words_.size());
    for (std::size_t w = 0; w < words_.size(); ++w) words_[w] = x.words_[w] & y.words_[w];
  }
  void intersect(const BitSet& other) {
    for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= other.words_[w];
  }
  [[nodiscard]] std::size_t count_common(const BitSet& other) const {
    std::size_t count = 0;
    for (std::size_t w = 0; w < words_.size(); ++w)
      count += static_cast<std::size_t>(std::popcount(words_[w] & other.words_[w]));
    return count;
  }
  /// True if every element except for `i` is in `other`. Precondition: `i` is an element of this
  /// set and not of `other`.
  [[nodiscard]] bool all_but_one_in(std::size_t i, const BitSet& other) const {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      const std::uint64_t itself = w == i / 64 ? std::uint64_t{1} << (i % 64) : 0;
      if ((words_[w] & ~other.words_[w]) != itself) return false;
    }
    return true;
  }
  [[nodiscard]] bool intersects(const BitSet& other) const {
    for (std::size_t w = 0; w < words_.size(); ++w)
      if ((words_[w] & other.words_[w]) != 0) return true;
    return false;
  }
  /// The common element if there is exactly one; faster than count_common().
  [[nodiscard]] std::optional<std::size_t> only_common(const BitSet& other) const {
    std::optional<std::size_t> only;
    for (std::size_t w = 0; w < words_.size(); ++w) {
      const std::uint64_t word = words_[w] & other.words_[w];
      if (word == 0) continue;
      if (only || (word & (word - 1)) != 0) return std::nullopt;
      only = 64 * w + static_cast<std::size_t>(std::countr_zero(word));
    }
    return only;
  }

 private:
  std::vector<std::uint64_t> words_;
};

/// Undirected graph without loops, adjacency as bits. Vertices are numbered from 0.
class BitGraph {
 public:
  explicit BitGraph(std::size_t vertices = 0)
      : capacity_(vertices), rows_(vertices, BitSet(vertices)), degrees_(vertices, 0) {}

  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  /// Capacity of every set of vertices.
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  [[nodiscard]] const BitSet& neighbours(std::size_t v) const { return rows_[v]; }
  [[nodiscard]] std::size_t degree(std::size_t v) const { return degrees_[v]; }
  [[nodiscard]] bool adjacent(std::size_t u, std::size_t v) const { return rows_[u].contains(v); }

  /// Precondition: u and v differ and are not connected yet.
  void connect(std::size_t u, std::size_t v) {
    rows_[u].insert(v);
    rows_[v].insert(u);
    ++degrees_[u];
    ++degrees_[v];
  }

  /// Adds one vertex without edges and returns its number. Doubles the capacity when necessary.
  std::size_t add_vertex() {
    if (size() == capacity_) {
      capacity_ = std::max<std::size_t>(64, 2 * capacity_);
      for (BitSet& row : rows_) row.grow(capacity_);
    }
    rows_.emplace_back(capacity_);
    degrees_.push_back(0);
    return size() - 1;
  }

 private:
  std::size_t capacity_;
  std::vector<BitSet> rows_;
  std::vector<std::size_t> degrees_;
};

}  // namespace km
