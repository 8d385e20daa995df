#include "modules/loop_closure/matching.hpp"

#include <limits>
#include <utility>

#include "modules/place_recognition/hamming.hpp"

namespace km {
namespace {

struct Nearest {
  std::uint32_t index = 0;
  std::uint32_t distance = std::numeric_limits<std::uint32_t>::max();
};

[[gnu::always_inline]] inline std::vector<Match> match_all(const std::vector<Bits256>& a,
                                                           const std::vector<Bits256>& b,
                                                           const MatchRules& rules) {
  std::vector<Match> matches;
  std::vector<Nearest> nearest_of_b(b.size());
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    Nearest best, second;
    for (std::uint32_t j = 0; j < b.size(); ++j) {
      const std::uint32_t distance = hamming_distance(a[i], b[j]);
      if (distance < nearest_of_b[j].distance) nearest_of_b[j] = {i, distance};
      if (distance >= second.distance) continue;
      second = {j, distance};
      if (second.distance < best.distance) std::swap(best, second);
    }
    const auto distance = static_cast<int>(best.distance);
    if (distance <= rules.max_distance && distance < rules.max_ratio * second.distance)
      matches.push_back({i, best.index, distance});
  }
  std::erase_if(matches, [&](const Match& m) { return nearest_of_b[m.b].index != m.a; });
  return matches;
}

std::vector<Match> match_portable(const std::vector<Bits256>& a, const std::vector<Bits256>& b,
                                  const MatchRules& rules) {
  return match_all(a, b, rules);
}

#if defined(__x86_64__)
[[gnu::target("popcnt")]] std::vector<Match> match_popcount(const std::vector<Bits256>& a,
                                                            const std::vector<Bits256>& b,
                                                            const MatchRules& rules) {
  return match_all(a, b, rules);
}
#endif

std::vector<Bits256> bits_of(std::span<const OrbDescriptor> descriptors) {
  std::vector<Bits256> bits;
  bits.reserve(descriptors.size());
  for (const OrbDescriptor& descriptor : descriptors) bits.push_back(to_bits(descriptor));
  return bits;
}

}  // namespace

std::vector<Match> match_descriptors(std::span<const OrbDescriptor> a,
                                     std::span<const OrbDescriptor> b, const MatchRules& rules) {
  if (b.size() < 2) return {};
#if defined(__x86_64__)
  if (has_popcount()) return match_popcount(bits_of(a), bits_of(b), rules);
#endif
  return match_portable(bits_of(a), bits_of(b), rules);
}

}  // namespace km
