#include "apps/lab/crowd/word_owners.hpp"

#include <algorithm>

#include "apps/lab/crowd/place_sketch.hpp"
#include "modules/core/bytes.hpp"

namespace km {
namespace {

std::uint64_t claim(std::uint32_t word, RobotId robot) {
  std::uint64_t hash = kFnv1aBasis;
  mix_fnv1a(hash, (std::uint64_t{robot} << 32U) | word);
  // The high bits of FNV-1a depend little on the last byte. Multiplication and shift spread it
  // (finaliser of splitmix64: Steele, Lea and Flood, OOPSLA 2014).
  hash = (hash ^ (hash >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  hash = (hash ^ (hash >> 27U)) * 0x94d049bb133111ebULL;
  return hash ^ (hash >> 31U);
}

}  // namespace

RobotId owner_of(std::uint32_t word, std::span<const RobotId> robots) {
  // Equal hashes fall to the lower id, so that the order of `robots` does not matter.
  return *std::ranges::max_element(robots, [&](RobotId a, RobotId b) {
    const std::uint64_t claim_a = claim(word, a);
    const std::uint64_t claim_b = claim(word, b);
    return claim_a != claim_b ? claim_a < claim_b : a > b;
  });
}

std::vector<RobotId> owners_of(const BowVector& image, std::size_t words,
                               std::span<const RobotId> robots) {
  std::vector<RobotId> owners;
  if (robots.empty()) return owners;
  for (const std::uint32_t word : heaviest_words(image, words))
    owners.push_back(owner_of(word, robots));
  std::ranges::sort(owners);
  const auto repeated = std::ranges::unique(owners);
  owners.erase(repeated.begin(), repeated.end());
  return owners;
}

}  // namespace km
