#pragma once

#include <array>
#include <map>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/noise_histogram.hpp"

namespace km {

/// A cycle through two closures of one pair of robots and the odometry between their ends. The
/// error of the cycle is written in coordinates in which the covariance of the odometry is the
/// identity and the claimed covariance of the two closures is diagonal.
struct NoiseCycle {
  std::array<float, 6> error = {};  ///< [sigma of the odometry]; planar cycles use three entries.
  std::array<float, 6> variance = {};  ///< Claimed by the two closures, relative to the odometry.
  float log_if_false = 0.0F;           ///< Log density if a closure is false, in these coordinates.
  /// Derivatives of `error` with respect to the relative length of the odometry of each robot.
  std::array<std::array<float, 6>, 2> by_length = {};

  /// Splits the covariance of the error `e` into odometry `Sigma_o` and closures `Sigma_c`, both
  /// positive definite (`dimension` 2: on rows 2, 3 and 4). `log_if_false`: see cycle_mixture.hpp.
  /// `by_length`: the derivatives of `e`.
  [[nodiscard]] static NoiseCycle of(const Vector6& e, const Matrix6& Sigma_o,
                                     const Matrix6& Sigma_c, double log_if_false, int dimension,
                                     const std::array<Vector6, 2>& by_length = {Vector6::Zero(),
                                                                                Vector6::Zero()});
};

/// The cycles of one pair of robots (or of the closures inside one robot).
struct PairCycles {
  std::vector<NoiseCycle> inside = {};   ///< Both closures belong to one place.
  std::vector<NoiseCycle> between = {};  ///< The closures belong to two places.
  double places = 0.0;                   ///< Number of places, the independent observations.
  double factor = 1.0;                   ///< Noise of this pair over the noise of the team [ratio].
};

/// The knowledge of a robot about the noise of closures. It carries over from session to session.
struct ClosureNoiseRecord {
  NoiseHistogram lengths = {};               ///< Cycle lengths of the pairs that this robot counts.
  std::map<RobotId, PairCycles> pairs = {};  ///< By the other robot of the pair.
};

/// Estimates how many times larger than claimed the standard deviations of the closures of one pair
/// of robots are. `usual` is the factor of the whole team.
///
/// Model: the error of a cycle is normal with covariance Sigma_o + s^2 Sigma_c, or one of its
/// closures is false (see cycle_mixture.hpp). If `usual` is below 2/3, Sigma_o is scaled by
/// (1.5 usual)^2. The estimate is the s with the highest posterior density, a variance component
/// (Foerstner 1979). The prior of log s is a Cauchy distribution around log usual of width log 3.
/// The two kinds of cycles are fitted separately, because an error that all closures of a place
/// share shows only between places; the larger estimate counts. The result is `usual`, unless the
/// odds against it are 1000 to 1 and the estimate is at least 1.3 times as large. The odds must
/// also be so with odometry that is 1.5 times noisier. The result is also `usual` if odometry of
/// another length explains the errors better: then closures are not to blame. O(cycles^2).
[[nodiscard]] double estimate_closure_noise(const PairCycles& cycles, double usual);

/// True if the pair has enough places for estimate_closure_noise().
[[nodiscard]] bool shows_noise(const PairCycles& cycles);

/// True if the odds are 1000 to 1 that the noise of the closures of a pair is `factor` rather than
/// `excluded`, by its cycles between places.
[[nodiscard]] bool excludes_noise(const PairCycles& cycles, double excluded, double factor);

}  // namespace km
