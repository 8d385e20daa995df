#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/robust/odometry_breaks.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// Noise of the odometry of a robot: actual over claimed standard deviations.
struct OdometryNoise {
  double rotation = 1.0;     ///< At least 1.
  double translation = 1.0;  ///< At least 1.
  bool of_closures = false;  ///< The closures inside the robot have these ratios, too.
  std::size_t places = 0;    ///< Number of places behind the estimate.
  /// Closures that are more likely true than false; a subset if there are very many. Empty if the
  /// odometry is as precise as it claims.
  std::vector<PoseEdge> likely = {};

  /// The actual precision of a step of odometry, or of a closure if `of_closures`.
  [[nodiscard]] Precision corrected(const Precision& claimed) const {
    return {claimed.kappa / (rotation * rotation), claimed.tau / (translation * translation)};
  }
};

/// Estimates the noise of the odometry of a robot from the closures inside it. Each closure forms a
/// cycle with the chain of steps between its ends. If these cycles show noise, cycles of two
/// successive closures are added, see METHOD.md. `steps[k]` is from keyframe k to keyframe k + 1 of
/// one robot, and `closures` are between two of its keyframes. Some closures may be false.
/// `dimension` 2: poses are planar.
///
/// Model: the error e of a cycle (tangent vector) is normal with covariance
///     v_R C_R + v_t C_t + v_c S,
/// C_R and C_t are the claimed rotation and translation noise of the steps, accumulated along the
/// chain to first order with lever arms. S is the claimed covariance of the closure. If the closure
/// is false, its rotation is uniform and its end is uniform in a box with twice the sides of the
/// trajectory. The variance factors v maximise the posterior of this mixture. The priors are normal
/// with mean 0: that of log sqrt(v) has standard deviation log 3, and that of log sqrt(v_R / v_t)
/// log 2. With few cycles the factors therefore remain near 1. Variance components: Foerstner, "Ein
/// Verfahren zur Schaetzung von Varianz- und Kovarianzkomponenten", 1979; v_R and v_t are at least
/// 1. They are 1 unless the odds that odometry is noisier than it claims are at least 1000 to 1.
///
/// A second model has one factor for all rotations and one for all translations, of steps and of
/// closures. If its posterior is 1000 times as high, it counts: OdometryNoise::of_closures.
///
/// Closures near each other at both ends share most of their chain, and false closures between two
/// similar parts of the environment come in groups. Such closures form a place, which counts as one
/// cycle. Deterministic. O(steps + closures).
[[nodiscard]] OdometryNoise estimate_odometry_noise(std::span<const PoseEdge> steps,
                                                    std::span<const PoseEdge> closures,
                                                    int dimension);

/// Result of the comparison of the odometry of a robot with the closures inside it. By default,
/// odometry is as precise as it claims.
struct OdometryJudgement {
  std::vector<OdometryBreak> breaks = {};  ///< Wrong steps.
  OdometryNoise noise = {};                ///< Noise of the other steps.

  /// Corrects the weights of all `steps`, and the wrong steps.
  void correct(std::span<PoseEdge> steps) const;
};

/// `steps`: odometry from each keyframe to the next, as measured. `seconds`: see
/// find_odometry_breaks(). `corrects`: wrong steps are looked for.
[[nodiscard]] OdometryJudgement judge_odometry(std::span<const PoseEdge> steps,
                                               std::span<const PoseEdge> closures, int dimension,
                                               std::span<const double> seconds = {},
                                               bool corrects = true);

}  // namespace km
