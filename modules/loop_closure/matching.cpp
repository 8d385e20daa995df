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

// The matched bytes of a descriptor, as machine words.
struct MatchedBits {
  std::uint64_t low = 0;
  std::uint32_t high = 0;
};
static_assert(kMatchedBytes == sizeof(MatchedBits::low) + sizeof(MatchedBits::high));

MatchedBits matched_bits(const BinaryDescriptor& descriptor) {
  MatchedBits bits;
  std::memcpy(&bits.low, descriptor.data(), sizeof bits.low);
  std::memcpy(&bits.high, descriptor.data() + sizeof bits.low, sizeof bits.high);
  return bits;
}

[[gnu::always_inline]] inline std::uint32_t distance_of(const MatchedBits& a,
                                                        const MatchedBits& b) {
  return static_cast<std::uint32_t>(__builtin_popcountll(a.low ^ b.low) +
                                    __builtin_popcount(a.high ^ b.high));
}

struct Nearest {
  std::uint32_t index = 0;
  std::uint32_t distance = std::numeric_limits<std::uint32_t>::max();
};

[[gnu::always_inline]] inline std::vector<Match> match_all(const std::vector<MatchedBits>& a,
                                                           const std::vector<MatchedBits>& b,
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
    const auto distance = static_cast<int>(best.distance);
    if (distance <= rules.max_distance && distance < rules.max_ratio * second.distance)
      matches.push_back({i, best.index, distance});
  }
  std::erase_if(matches, [&](const Match& m) { return nearest_of_b[m.b].index != m.a; });
  return matches;
}

std::vector<Match> match_portable(const std::vector<MatchedBits>& a,
                                  const std::vector<MatchedBits>& b, const MatchRules& rules) {
  return match_all(a, b, rules);
}

#if defined(__x86_64__)
[[gnu::target("popcnt")]] std::vector<Match> match_popcount(const std::vector<MatchedBits>& a,
                                                            const std::vector<MatchedBits>& b,
                                                            const MatchRules& rules) {
  return match_all(a, b, rules);
}
#endif

std::vector<MatchedBits> bits_of(std::span<const BinaryDescriptor> descriptors) {
  std::vector<MatchedBits> bits;
  bits.reserve(descriptors.size());
  for (const BinaryDescriptor& descriptor : descriptors) bits.push_back(matched_bits(descriptor));
  return bits;
}

// Keypoints of one image in square cells, to find the keypoints near a position.
class KeypointGrid {
 public:
  KeypointGrid(const KeyframeFeatures& features, double cell_px) : cell_(cell_px) {
    for (const Keypoint& keypoint : features.keypoints)
      pixels_.push_back(features.focal_px * keypoint.bearing.cast<double>());
    Eigen::Vector2d high = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& pixel : pixels_) {
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
      const Eigen::Vector2i cell = cell_of(pixels_[i]);
      cells_[index(cell.x(), cell.y())].push_back(i);
    }
  }

  const Eigen::Vector2d& pixel(std::size_t i) const { return pixels_[i]; }

  /// Calls visit(i) for every keypoint in the cell of `pixel` and the eight cells around it.
  void near(const Eigen::Vector2d& pixel, auto&& visit) const {
    if (!((pixel - low_).minCoeff() >= -cell_)) return;
    if (pixel.x() > low_.x() + (columns_ + 1) * cell_ || pixel.y() > low_.y() + (rows_ + 1) * cell_)
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

struct Candidate {
  std::uint32_t index;
  int distance;
};

// The best match of one descriptor among the keypoints near its projection.
std::optional<Candidate> best_near(const Projection& projection, const BinaryDescriptor& descriptor,
                                   const KeyframeFeatures& features, const KeypointGrid& grid,
                                   const GuidedMatchRules& rules) {
  // Several octaves show one corner, so a keypoint this close to the best one is no second best.
  constexpr double kSameCorner_px = 3.0;
  const MatchedBits query = matched_bits(descriptor);
  const double disparity_scale = features.focal_px * features.baseline_m;
  std::vector<Candidate> near;
  grid.near(projection.pixel, [&](std::uint32_t i) {
    if ((grid.pixel(i) - projection.pixel).norm() > rules.radius_px) return;
    const Keypoint& keypoint = features.keypoints[i];
    const double off = static_cast<double>(keypoint.inverse_depth) - projection.inverse_depth;
    if (keypoint.has_depth() && std::abs(off) * disparity_scale > rules.radius_px) return;
    const std::uint32_t bits = distance_of(query, matched_bits(features.descriptors[i]));
    near.push_back({i, static_cast<int>(bits)});
  });
  const auto best = std::min_element(near.begin(), near.end(), [](const auto& l, const auto& r) {
    return l.distance < r.distance;
  });
  if (best == near.end() || best->distance > rules.max_distance) return std::nullopt;
  for (const Candidate& rival : near)
    if ((grid.pixel(rival.index) - grid.pixel(best->index)).norm() > kSameCorner_px &&
        best->distance > rules.max_ratio * rival.distance)
      return std::nullopt;
  return *best;
}

}  // namespace

std::vector<Match> match_descriptors(std::span<const BinaryDescriptor> a,
                                     std::span<const BinaryDescriptor> b, const MatchRules& rules) {
  if (b.size() < 2) return {};
#if defined(__x86_64__)
  if (has_popcount()) return match_popcount(bits_of(a), bits_of(b), rules);
#endif
  return match_portable(bits_of(a), bits_of(b), rules);
}

std::vector<Match> match_guided(const SE3& T_a_b, const KeyframeFeatures& a,
                                const KeyframeFeatures& b, const GuidedMatchRules& rules) {
  std::vector<Match> found;
  if (a.keypoints.empty() || b.keypoints.empty()) return found;
  const KeypointGrid grid_a(a, rules.radius_px);
  const KeypointGrid grid_b(b, rules.radius_px);
  const SE3 T_b_a = T_a_b.inverse();
  for (std::uint32_t i = 0; i < a.keypoints.size(); ++i) {
    if (!a.keypoints[i].has_depth()) continue;
    const std::optional<Projection> projection = project(T_b_a, a.keypoints[i], b.focal_px);
    if (!projection) continue;
    const auto best = best_near(*projection, a.descriptors[i], b, grid_b, rules);
    if (best) found.push_back({i, best->index, best->distance});
  }
  for (std::uint32_t j = 0; j < b.keypoints.size(); ++j) {
    if (!b.keypoints[j].has_depth()) continue;
    const std::optional<Projection> projection = project(T_a_b, b.keypoints[j], a.focal_px);
    if (!projection) continue;
    const auto best = best_near(*projection, b.descriptors[j], a, grid_a, rules);
    if (best) found.push_back({best->index, j, best->distance});
  }

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
