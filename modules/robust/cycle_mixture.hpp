#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Cycles of a pose graph, some of which contain a false closure. A cycle is true if all of its
/// closures are true, and false otherwise.
struct CycleMixture {
  double share = 0.8;           ///< Most likely share of true cycles.
  double log_likelihood = 0.0;  ///< Relative to all cycles being false.

  /// Probability that a cycle is true, from its log density ratio (true over false).
  [[nodiscard]] double true_probability(double log_ratio) const;
  /// Log density of a cycle, relative to the cycle being false.
  [[nodiscard]] double log_density(double log_ratio) const;
};

/// Fits the share of true cycles by expectation maximisation. `log_ratio[k]` is the log density of
/// the error of cycle k if it is true, minus the log density if it is false. `weight[k]` is the
/// number of independent observations that cycle k stands for. O(cycles).
[[nodiscard]] CycleMixture fit_cycle_mixture(std::span<const double> log_ratio,
                                             std::span<const double> weight);

/// Log density of the error of a cycle with a false closure, in the tangent space at the error. The
/// rotation is uniform and the translation is uniform in a volume [m^3] (`dimension` 2: an area
/// [m^2]). det J = 2 (1 - cos |w|) / |w|^2 is the determinant of the Jacobian of the exponential
/// map of rotations; that of poses has it squared.
[[nodiscard]] double log_density_if_false(const Vector6& error, double volume, int dimension = 3);

/// The volume in which a false closure may end. Each side is the sum of the sides of the bounding
/// boxes of the lower and of the upper ends, plus twice the length of the longest closure.
class ClosureVolume {
 public:
  /// Positions [m] where the ends of a closure are, or may be.
  void add_ends(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper);
  void add_length(double length_m);
  /// [m^3]; `dimension` 2: the area [m^2].
  [[nodiscard]] double of(int dimension) const;

 private:
  Eigen::AlignedBox3d below_, above_;
  double reach_m_ = 0.0;
};

/// Log densities of the errors of cycles if they are false, and false closures end near each other:
/// their translations are normal with the variance of all. `uniform`: their log densities by
/// log_density_if_false(). nullopt unless the normal ones are more likely, and some cycles are true
/// with odometry as claimed. `log_if_true` takes the index of a cycle and one of kNoiseOfClosures.
[[nodiscard]] std::optional<std::vector<double>> log_densities_if_near(
    std::span<const Vector6> errors, const std::vector<double>& uniform,
    const std::function<double(std::size_t, double)>& log_if_true, int dimension);

/// Factors on the noise of closures beside which the noise of odometry is estimated.
inline constexpr std::array kNoiseOfClosures{1.0, 2.0, 4.0, 8.0};

// Priors that fits of noise share.
inline constexpr double kMostlyTrue = 0.5;  ///< Share of true cycles from which on most are true.
inline constexpr double kNoiseFactorWidth = 1.0986;  ///< Log 3, of the log of a factor of noise.
inline constexpr double kThousandToOne = 6.9;  ///< Log of odds against unusual noise of closures.
/// Log of odds against noise of odometry. A precise robot that seems noisy loses little. A noisy
/// one that seems precise loses true closures.
inline constexpr double kTenToOne = 2.3;

}  // namespace km
