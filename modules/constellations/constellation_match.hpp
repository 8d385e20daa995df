#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "modules/constellations/landmark.hpp"
#include "modules/core/data/covariance.hpp"

namespace km {

/// Limits of a match of two constellations.
struct ConstellationOptions {
  /// Largest difference of two distances that should be equal, in standard deviations. With 2.5,
  /// 1.2 % of the differences of normal errors are larger.
  double gate = 2.5;
  /// Standard deviation of the tilt of a frame. A common tilt of 5 to 12 mrad is usual for inertial
  /// sensors, because of the bias of accelerometers.
  double tilt_rad = 0.01;
  /// Number of pairs that the best transform has more than any other one, see
  /// match_constellations().
  std::size_t margin = 7;
  /// Bound on the nodes of each clique search. A search beyond it decides nothing.
  std::uint64_t max_search_nodes = 20'000;
};

enum class ConstellationStatus {
  kMatched,
  kTooFew,     ///< No set of min_pairs() pairs is consistent.
  kAmbiguous,  ///< A second transform has nearly as many pairs.
  kUndecided,  ///< A clique search ended at its limit, or too many objects are equal.
};

/// "matched", "too few", "ambiguous", "undecided"
[[nodiscard]] const char* to_string(ConstellationStatus status);

struct [[nodiscard]] ConstellationMatch {
  ConstellationStatus status = ConstellationStatus::kTooFew;
  UncertainPose T_a_b = {};  ///< Only if matched, see constellation_pose().
  std::vector<std::array<std::size_t, 2>> pairs = {};  ///< Indices in a and b, ascending in a.
  std::size_t second_pairs = 0;  ///< Number of pairs of the largest set with another transform.
};

/// Smallest number of pairs of a match: the margin beside the two pairs that any transform has.
[[nodiscard]] std::size_t min_pairs(const ConstellationOptions& options);

/// Finds the relative pose at which the most objects of two robots agree. Nothing is known about
/// this pose, except for the vertical of both frames.
///
/// An association is a landmark of a and one of b with equal label and similar size. Two
/// associations are consistent if their landmarks are equally far from each other in both maps, in
/// the plane and along gravity separately, as ROMAN compares them (Peterson et al., "ROMAN:
/// Open-Set Object Map Alignment for Robust View-Invariant Global Localization", 2024). The largest
/// set of pairwise consistent associations is a maximum clique of the consistency graph (Lusk et
/// al., "CLIPPER: A Graph-Theoretic Framework for Robust Data Association", ICRA 2021). Both relax
/// this problem to weighted subgraphs. Here the exact clique is searched.
///
/// Deviation: a constellation and its mirror image have equal distances in the plane. Two
/// associations also determine a yaw, so the clique is searched in each of 36 windows of yaw.
///
/// The largest set with another transform shows how many pairs chance gives in these maps, with
/// their rows and labels. In 540 searches between maps of unrelated places the best transform has
/// 0 pairs more in 290, 1 in 214, 2 in 24, 3 in 9, and 4 in 3. Each further pair is about a third
/// as probable, so 7 are expected once in 5000 searches. The match is ambiguous if the best
/// transform has not `margin` pairs more than any other one, or if the other one has more than 60 %
/// of its pairs. Associations that fit the first transform may not support the second one, except
/// for one of them. So equal objects at equal distances are refused, because a shift by one
/// explains all of them except for one.
///
/// `a` and `b` are in frames with z up [m]. Throws std::invalid_argument for a landmark that is not
/// finite or has no positive sigma. Time grows with the fourth power of the landmarks of a label.
[[nodiscard]] ConstellationMatch match_constellations(std::span<const Landmark> a,
                                                      std::span<const Landmark> b,
                                                      const ConstellationOptions& options = {});

}  // namespace km
