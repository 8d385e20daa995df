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
  /// Ratio of closures to odometry, each with its actual over claimed noise. It is 1 unless it
  /// reaches 16, the odds are 1000 to 1, also against any noise above the claims, and most cycles
  /// are true. Odometry is then no noisier than it claims.
  double beside = 1.0;
  std::size_t places = 0;  ///< Number of places behind the estimate.
  /// Closures that are more likely true than false; a subset if there are very many. Empty if the
  /// odometry is as precise as it claims.
  std::vector<PoseEdge> likely = {};

  /// The actual precision of a step of odometry.
  [[nodiscard]] Precision corrected(const Precision& claimed) const {
    return {claimed.kappa / (rotation * rotation), claimed.tau / (translation * translation)};
  }
  /// The actual precision of a closure inside the robot.
  [[nodiscard]] Precision corrected_closure(const Precision& claimed) const {
    const auto [kappa, tau] = of_closures ? corrected(claimed) : claimed;
    return {kappa / (beside * beside), tau / (beside * beside)};
  }
};

/// Estimates the noise of the odometry of a robot from the closures inside it, by cycles of one
/// closure and of two successive ones: see Noise in METHOD.md. The factors of rotations and of
/// translations are variance components (Foerstner 1979). The priors are normal with mean 0: that
/// of log sqrt(v) has standard deviation log 3, and that of log sqrt(v_R / v_t) log 2. `steps[k]`
/// is from keyframe k to keyframe k + 1 of one robot, and `closures` are between two of its
/// keyframes. Some closures may be false; if most cycles seem false, the result is what odometry
/// claims. `dimension` 2: poses are planar. O(steps + closures).
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
