#include "modules/loop_closure/matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "modules/place_recognition/hamming.hpp"

namespace km {
namespace {

constexpr int kLargest = 7;  // number of 4 bits
constexpr int kZero = 8;     // is stored for a number of 0

// Tests of ORB as machine words.
struct Bits {
  static constexpr double kUnit = 1.0;  // distance of 1 bit
  std::uint64_t low = 0;
  std::uint32_t high = 0;

  explicit Bits(const MatchedDescriptor& descriptor) {
    std::memcpy(&low, descriptor.data(), sizeof low);
    std::memcpy(&high, descriptor.data() + sizeof low, sizeof high);
  }
};
static_assert(kMatchedBytes == sizeof(Bits::low) + sizeof(Bits::high));

[[gnu::always_inline]] inline std::uint32_t distance_of(const Bits& a, const Bits& b) {
  return static_cast<std::uint32_t>(__builtin_popcountll(a.low ^ b.low) +
                                    __builtin_popcount(a.high ^ b.high));
}

// Numbers of a network.
struct Numbers {
  static constexpr double kUnit = kMaxMatchDistance / kMaxNumberDistance;
  std::array<std::int16_t, kMatchedNumbers> values;

  explicit Numbers(const MatchedDescriptor& descriptor) : values(numbers_of(descriptor)) {}
};

[[gnu::always_inline]] inline std::uint32_t distance_of(const Numbers& a, const Numbers& b) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < kMatchedNumbers; ++i) {
    const std::int32_t off = a.values[i] - b.values[i];
    sum += off * off;
  }
  return static_cast<std::uint32_t>(sum);
}

template <typename Prepared>
std::vector<Prepared> prepared(std::span<const MatchedDescriptor> descriptors) {
  return {descriptors.begin(), descriptors.end()};
}

struct Nearest {
  std::uint32_t index = 0;
  std::uint32_t distance = std::numeric_limits<std::uint32_t>::max();
};

template <typename Prepared>
[[gnu::always_inline]] inline std::vector<Match> match_all(const std::vector<Prepared>& a,
                                                           const std::vector<Prepared>& b,
                                                           const MatchRules& rules) {
  std::vector<Match> matches;
  std::vector<Nearest> nearest_of_b(b.size());
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    Nearest best, second;
    for (std::uint32_t j = 0; j < b.size(); ++j) {
      const std::uint32_t distance = distance_of(a[i], b[j]);
      if (distance < nearest_of_b[j].distance) nearest_of_b[j] = {i, distance};
      if (distance >= second.distance) continue;
      second = {j, distance};
      if (second.distance < best.distance) std::swap(best, second);
    }
    const double distance = Prepared::kUnit * best.distance;
    if (distance <= rules.max_distance && best.distance < rules.max_ratio * second.distance)
      matches.push_back({i, best.index, distance});
  }
  std::erase_if(matches, [&](const Match& m) { return nearest_of_b[m.b].index != m.a; });
  return matches;
}

// Keypoints of one image in square cells, to find the keypoints near a position.
class KeypointGrid {
 public:
  KeypointGrid(const KeyframeFeatures& features, double cell_px) : cell_(cell_px) {
    for (const Keypoint& keypoint : features.keypoints)
      pixels_.push_back(features.focal_px * keypoint.bearing.cast<double>());
    Eigen::Vector2d high = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& pixel : pixels_) {
      if (!pixel.allFinite()) continue;  // never found
      low_ = low_.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
    // Bounds the grid, because features from another robot may be arbitrarily far apart.
    constexpr double kMaxCellsAcross = 512.0;
    cell_ = std::max(cell_, (high - low_).maxCoeff() / kMaxCellsAcross);
    columns_ = static_cast<int>((high.x() - low_.x()) / cell_) + 1;
    rows_ = static_cast<int>((high.y() - low_.y()) / cell_) + 1;
    cells_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (std::uint32_t i = 0; i < pixels_.size(); ++i) {
      if (!pixels_[i].allFinite()) continue;
      const Eigen::Vector2i cell = cell_of(pixels_[i]);
      cells_[index(cell.x(), cell.y())].push_back(i);
    }
  }

  const Eigen::Vector2d& pixel(std::size_t i) const { return pixels_[i]; }

  /// Calls visit(i) for every keypoint in the cell of `pixel` and the eight cells around it.
  void near(const Eigen::Vector2d& pixel, auto&& visit) const {
    const Eigen::Vector2d cells = (pixel - low_) / cell_;
    if (!(cells.x() >= -1.0 && cells.x() <= columns_ + 1 && cells.y() >= -1.0 &&
          cells.y() <= rows_ + 1))
      return;
    const Eigen::Vector2i centre = cell_of(pixel);
    for (int y = std::max(centre.y() - 1, 0); y <= std::min(centre.y() + 1, rows_ - 1); ++y)
      for (int x = std::max(centre.x() - 1, 0); x <= std::min(centre.x() + 1, columns_ - 1); ++x)
        for (const std::uint32_t i : cells_[index(x, y)]) visit(i);
  }

 private:
  Eigen::Vector2i cell_of(const Eigen::Vector2d& pixel) const {
    return ((pixel - low_) / cell_).array().floor().cast<int>();
  }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y * columns_ + x); }

  double cell_;
  int columns_ = 0, rows_ = 0;
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<std::vector<std::uint32_t>> cells_;
};

// Projection of a keypoint into the other camera.
struct Projection {
  Eigen::Vector2d pixel;
  double inverse_depth;
};

std::optional<Projection> project(const SE3& T_to_from, const Keypoint& keypoint, double focal_px) {
  const auto rho = static_cast<double>(keypoint.inverse_depth);
  const Eigen::Vector3d h = T_to_from.linear() * keypoint.bearing.cast<double>().homogeneous() +
                            rho * T_to_from.translation();
  constexpr double kLeastDepthRatio = 1e-3;
  if (!(h.z() > kLeastDepthRatio)) return std::nullopt;
  return Projection{focal_px * h.hnormalized(), rho / h.z()};
}

// A keyframe with its prepared descriptors and the grid to find keypoints.
template <typename Prepared>
struct Compared {
  const KeyframeFeatures& features;
  std::vector<Prepared> descriptors;
  KeypointGrid grid;

  Compared(const KeyframeFeatures& keyframe, std::uint16_t network, double cell_px)
      : features(keyframe),
        descriptors(prepared<Prepared>(matched_by(network, keyframe))),
        grid(keyframe, cell_px) {}
};

// The best match of one descriptor among the keypoints near its projection.
template <typename Prepared>
std::optional<Nearest> best_near(const Projection& projection, const Prepared& query,
                                 const Compared<Prepared>& others, const GuidedMatchRules& rules) {
  // Several octaves show one corner, so a keypoint this close to the best one is no second best.
  constexpr double kSameCorner_px = 3.0;
  const auto& [features, descriptors, grid] = others;
  const double disparity_scale = features.focal_px * features.baseline_m;
  std::vector<Nearest> near;
  grid.near(projection.pixel, [&](std::uint32_t i) {
    if (!((grid.pixel(i) - projection.pixel).norm() <= rules.radius_px)) return;
    const Keypoint& keypoint = features.keypoints[i];
    const double off = static_cast<double>(keypoint.inverse_depth) - projection.inverse_depth;
    if (keypoint.has_depth() && !(std::abs(off) * disparity_scale <= rules.radius_px)) return;
    near.push_back({i, distance_of(query, descriptors[i])});
  });
  const auto best = std::min_element(near.begin(), near.end(), [](const auto& l, const auto& r) {
    return l.distance < r.distance;
  });
  if (best == near.end() || Prepared::kUnit * best->distance > rules.max_distance)
    return std::nullopt;
  for (const Nearest& rival : near)
    if ((grid.pixel(rival.index) - grid.pixel(best->index)).norm() > kSameCorner_px &&
        best->distance > rules.max_ratio * rival.distance)
      return std::nullopt;
  return *best;
}

// Matches of the points with depth of either keyframe. One keypoint may occur several times.
template <typename Prepared>
std::vector<Match> matches_near(const SE3& T_a_b, const Compared<Prepared>& a,
                                const Compared<Prepared>& b, const GuidedMatchRules& rules) {
  std::vector<Match> found;
  if (a.descriptors.empty() || b.descriptors.empty()) return found;
  const auto search = [&](const SE3& T_to_from, const auto& from, const auto& to, auto&& add) {
    for (std::uint32_t i = 0; i < from.features.keypoints.size(); ++i) {
      const Keypoint& keypoint = from.features.keypoints[i];
      if (!keypoint.has_depth()) continue;
      const auto projection = project(T_to_from, keypoint, to.features.focal_px);
      if (!projection) continue;
      if (const auto best = best_near(*projection, from.descriptors[i], to, rules))
        add(i, best->index, Prepared::kUnit * best->distance);
    }
  };
  search(T_a_b.inverse(), a, b, [&](auto i, auto j, double d) { found.push_back({i, j, d}); });
  search(T_a_b, b, a, [&](auto j, auto i, double d) { found.push_back({i, j, d}); });
  return found;
}

template <typename Prepared>
std::vector<Match> matches_near(const SE3& T_a_b, const KeyframeFeatures& a,
                                const KeyframeFeatures& b, const GuidedMatchRules& rules) {
  const std::uint16_t network = common_network(a, b);
  return matches_near(T_a_b, Compared<Prepared>(a, network, rules.radius_px),
                      Compared<Prepared>(b, network, rules.radius_px), rules);
}

}  // namespace

std::vector<MatchedDescriptor> orb_bits(std::span<const BinaryDescriptor> descriptors) {
  std::vector<MatchedDescriptor> bits(descriptors.size());
  for (std::size_t i = 0; i < bits.size(); ++i)
    std::copy_n(descriptors[i].begin(), kMatchedBytes, bits[i].begin());
  return bits;
}

MatchedDescriptor descriptor_of_numbers(std::span<const float> numbers) {
  double squares = 0.0;
  for (const float x : numbers) squares += static_cast<double>(x) * static_cast<double>(x);
  const double factor =
      squares > 0.0 ? kNumberSteps * std::sqrt(static_cast<double>(kMatchedNumbers) / squares)
                    : 0.0;
  MatchedDescriptor descriptor{};
  for (std::size_t i = 0; i < kMatchedNumbers; ++i) {
    const double steps = std::clamp<double>(std::round(factor * static_cast<double>(numbers[i])),
                                            -kLargest, kLargest);
    const auto stored = static_cast<unsigned>(static_cast<int>(steps) + kZero);
    descriptor[i / 2] |= static_cast<std::uint8_t>(stored << (i % 2 == 0 ? 0U : 4U));
  }
  return descriptor;
}

std::array<std::int16_t, kMatchedNumbers> numbers_of(const MatchedDescriptor& descriptor) {
  std::array<std::int16_t, kMatchedNumbers> numbers{};
  for (std::size_t i = 0; i < kMatchedNumbers; ++i) {
    const unsigned stored = descriptor[i / 2] >> (i % 2 == 0 ? 0U : 4U) & 0xFU;
    numbers[i] = static_cast<std::int16_t>(static_cast<int>(stored) - kZero);
  }
  return numbers;
}

std::vector<MatchedDescriptor> matched_by(std::uint16_t network, const KeyframeFeatures& features) {
  const bool has_own_tests = network == 0 && !features.descriptors.empty();
  if (has_own_tests) return orb_bits(features.descriptors);
  return network == features.network ? features.matched : std::vector<MatchedDescriptor>();
}

std::vector<Match> match_descriptors(const KeyframeFeatures& a, const KeyframeFeatures& b,
                                     const MatchRules& rules) {
  const std::uint16_t network = common_network(a, b);
  const auto own = matched_by(network, a), theirs = matched_by(network, b);
  if (theirs.size() < 2) return {};
  if (network == 0)
    return run_counting_bits([&]() __attribute__((always_inline)) {
      return match_all(prepared<Bits>(own), prepared<Bits>(theirs), rules);
    });
  return match_all(prepared<Numbers>(own), prepared<Numbers>(theirs), rules);
}

std::vector<Match> match_guided(const SE3& T_a_b, const KeyframeFeatures& a,
                                const KeyframeFeatures& b, const GuidedMatchRules& rules) {
  if (a.keypoints.empty() || b.keypoints.empty()) return {};
  std::vector<Match> found = common_network(a, b) == 0 ? matches_near<Bits>(T_a_b, a, b, rules)
                                                       : matches_near<Numbers>(T_a_b, a, b, rules);

  // Each keypoint once, the most similar pairs first.
  std::sort(found.begin(), found.end(), [](const Match& l, const Match& r) {
    return std::tie(l.distance, l.a, l.b) < std::tie(r.distance, r.a, r.b);
  });
  std::vector<bool> used_a(a.keypoints.size()), used_b(b.keypoints.size());
  std::erase_if(found, [&](const Match& m) {
    if (used_a[m.a] || used_b[m.b]) return true;
    used_a[m.a] = used_b[m.b] = true;
    return false;
  });
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace km
