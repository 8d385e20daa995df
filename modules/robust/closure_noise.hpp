#pragma once

#include <array>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/robust/noise_histogram.hpp"

namespace km {

/// A cycle through two closures of one pair of robots and the odometry between their ends. The
/// error of the cycle is written in coordinates in which the covariance of the odometry is the
/// identity and the claimed covariance of the two closures is diagonal.
struct NoiseCycle {
  std::array<float, 6> error = {};     ///< [sigma of the odometry]
  std::array<float, 6> variance = {};  ///< Claimed for the two closures, relative to the odometry.
  std::size_t axes = 6;                ///< Number of entries; 3 in the plane.
  float log_if_false = 0.0F;           ///< Log density if a closure is false, in these coordinates.

  /// The cycle with the error `e`. Its covariances are `Sigma_o` of the odometry and `Sigma_c` of
  /// the two closures, both positive definite (`dimension` 2: on rows 2, 3 and 4). `log_if_false`
  /// is that of `e`, see log_density_if_false().
  [[nodiscard]] static NoiseCycle of(const Vector6& e, const Matrix6& Sigma_o,
                                     const Matrix6& Sigma_c, double log_if_false, int dimension);
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
  /// Cycle lengths of the pairs in which this robot has the lower id, and of this robot alone.
  NoiseHistogram lengths = {};
  std::map<RobotId, PairCycles> pairs = {};  ///< By the other robot; own id: inside this robot.
  /// The robots of the team whose odometry is noisier than it claims, see likely_odometry_noise().
  std::vector<std::pair<RobotId, double>> odometry = {};
};

/// Estimates how many times larger than claimed the standard deviations of the closures of one pair
/// of robots are, see Noise in METHOD.md. `usual` is the factor of the whole team, and the result
/// without strong evidence. The estimate of this variance component (Foerstner 1979) is the
/// smallest s >= `usual` whose log posterior density is within 0.5 of the largest one. The prior of
/// log s is a Cauchy distribution around log usual of width log 3. The two kinds of cycles are
/// fitted separately, because an error that all closures of a place share shows only between
/// places. The larger estimate counts. O(cycles^2).
[[nodiscard]] double estimate_closure_noise(const PairCycles& cycles, double usual);

/// True if the pair has enough places for estimate_closure_noise().
[[nodiscard]] bool shows_noise(const PairCycles& cycles);

/// True if the closures of a pair have the noise `factor` of closures inside one of its robots,
/// and not the usual one. The odds are then at least 1000 to 1.
[[nodiscard]] bool shows_factor(const PairCycles& cycles, double usual, double factor);

/// True if the cycles of a pair between places contradict the noise `excluded`. The odds are then
/// at least 1000 to 1 that closures are `factor` times noisier than claimed, and not `excluded`
/// times.
[[nodiscard]] bool excludes_noise(const PairCycles& cycles, double excluded, double factor);

}  // namespace km
