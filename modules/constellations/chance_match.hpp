#pragma once

#include <array>
#include <span>
#include <vector>

#include "modules/constellations/landmark.hpp"

namespace km {

/// Decides how often chance alone gives a match as good as an observed one: the number of false
/// alarms of the a contrario method (Moisan and Stival, "A Probabilistic Criterion to Detect Rigid
/// Point Matches Between Two Images and Estimate the Fundamental Matrix", IJCV 2004), for landmarks
/// in a plane.
///
/// If the places of b are unrelated to those of a, its landmarks are independent of each other. Two
/// pairs, the base, then determine yaw and translation. Each further landmark of b lies within the
/// distance t of its prediction with a probability p(t). The expected number of sets of k pairs,
/// with k_l of n_l and m_l landmarks of each label l, that fit within `rho` standard deviations is
/// at most
///
///     E = tests * prod_l C(n_l, k_l) C(m_l, k_l) k_l!  *  P_base * prod_{others} p(rho s) (2)
///
/// The factor `tests` counts the numbers k_l and the values of rho among which the match may
/// choose. By Markov's inequality, a random pair of constellations has such a match with a
/// probability of at most E.
///
/// Landmarks stand in rows, for example along a kerb. p(t) = p_u(t) p_v(t) has one factor for each
/// axis of the area of b. For even places a factor is 2 t / length. For rows it is the share of
/// pairs of equal label in b that are at most t apart along this axis. The larger one counts.
/// P_base is the larger one of two: the share of the ring of radius d and width 2 t in the area,
/// and 2 p(t). The latter is for rows, which determine the yaw up to half a turn. Distances along z
/// do not count, because most landmarks stand on one ground.
class ChanceMatch {
 public:
  static constexpr double kRhoStep = 0.25;  ///< rho is rounded up to a multiple of this.
  static constexpr double kMinRho = 0.5;
  static constexpr double kMaxRho = 5.0;

  ChanceMatch(std::span<const Landmark> a, std::span<const Landmark> b);

  /// log10 of E, Eq. (2). The base is the two pairs that are farthest apart in b. Infinite for
  /// fewer than three pairs, and if a pair is farther than kMaxRho standard deviations from its
  /// prediction. Precondition: the pairs are of a and b, each landmark in at most one.
  [[nodiscard]] double log10_expected(std::span<const LandmarkPair> pairs) const;

 private:
  struct LabelCount {
    LabelId label = 0;
    int a = 0, b = 0;
  };
  [[nodiscard]] double place_probability(double t_m) const;
  [[nodiscard]] double log_choices(std::span<const LandmarkPair> pairs) const;

  std::vector<LabelCount> counts_;            // labels that both sides have
  Eigen::Vector2d length_m_;                  // lengths of the area of b
  std::array<std::vector<double>, 2> apart_;  // sorted: distances of pairs of equal label per axis
};

}  // namespace km
