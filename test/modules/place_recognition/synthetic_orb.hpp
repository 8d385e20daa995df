#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "modules/core/keyframe.hpp"

namespace km {

/// Descriptors with the structure that makes a vocabulary tree worthwhile. They come from a random
/// tree of branching 10 whose nodes differ from their parents by 70, 45, 28, 18, 12, 8 bits, level
/// by level. Its leaves are the points of a world, some seen more often than others (log-normal
/// popularity, sigma 1). Each sighting flips a few bits more.
class SyntheticOrb {
 public:
  SyntheticOrb(int depth, std::uint32_t seed) : rng_(seed) {
    constexpr std::array kFlips = {70, 45, 28, 18, 12, 8};
    BinaryDescriptor root{};
    for (std::uint8_t& byte : root) byte = static_cast<std::uint8_t>(rng_());
    leaves_ = {root};
    for (int level = 0; level < depth; ++level) {
      std::vector<BinaryDescriptor> next;
      next.reserve(leaves_.size() * 10);
      for (const BinaryDescriptor& parent : leaves_)
        for (int child = 0; child < 10; ++child)
          next.push_back(flipped(parent, kFlips[static_cast<std::size_t>(level)]));
      leaves_ = std::move(next);
    }
    std::lognormal_distribution<double> popularity(0.0, 1.0);
    double total = 0.0;
    for (std::size_t i = 0; i < leaves_.size(); ++i)
      cumulative_.push_back(total += popularity(rng_));
  }

  /// An image: `count` sightings of independently drawn leaves, `flips` bits from them.
  std::vector<BinaryDescriptor> image(std::size_t count, int flips) {
    std::uniform_real_distribution<double> uniform(0.0, cumulative_.back());
    std::vector<BinaryDescriptor> result;
    for (std::size_t i = 0; i < count; ++i) {
      const auto drawn = std::lower_bound(cumulative_.begin(), cumulative_.end(), uniform(rng_));
      result.push_back(
          flipped(leaves_[static_cast<std::size_t>(drawn - cumulative_.begin())], flips));
    }
    return result;
  }

  std::vector<std::vector<BinaryDescriptor>> images(std::size_t number, std::size_t count,
                                                    int flips) {
    std::vector<std::vector<BinaryDescriptor>> result;
    for (std::size_t i = 0; i < number; ++i) result.push_back(image(count, flips));
    return result;
  }

 private:
  // `flips` different bits, inverted.
  BinaryDescriptor flipped(BinaryDescriptor descriptor, int flips) {
    BinaryDescriptor changed{};
    for (int done = 0; done < flips;) {
      const auto bit = static_cast<std::size_t>(rng_() % 256U);
      const auto mask = static_cast<std::uint8_t>(1U << (bit % 8));
      if ((changed[bit / 8] & mask) != 0) continue;
      changed[bit / 8] = static_cast<std::uint8_t>(changed[bit / 8] | mask);
      descriptor[bit / 8] = static_cast<std::uint8_t>(descriptor[bit / 8] ^ mask);
      ++done;
    }
    return descriptor;
  }

  std::mt19937 rng_;
  std::vector<BinaryDescriptor> leaves_;
  std::vector<double> cumulative_;
};

}  // namespace km
