#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/pose_graph/pose_edge.hpp"

namespace km {

/// How noisy a robot's odometry is, in standard deviations of what it claims.
struct OdometryNoise {
  double rotation = 1.0;     ///< At least 1.
  double translation = 1.0;  ///< At least 1.
  std::size_t places = 0;    ///< That bear witness; see estimate_odometry_noise().
  /// Closures that are more likely true than false, a part of very many; empty where odometry is
  /// taken at its word.
  std::vector<PoseEdge> likely = {};

  /// The precision of a step that claims `claimed`.
  [[nodiscard]] Precision corrected(const Precision& claimed) const {
    return {claimed.kappa / (rotation * rotation), claimed.tau / (translation * translation)};
  }
};

/// Estimates how noisy the odometry of a robot is from the closures inside it: each closes a cycle
/// with the chain of steps between its ends. `steps[k]` is from keyframe k to keyframe k + 1 of one
/// robot, `closures` are between two of its keyframes. Some closures may be false.
///
/// Model: the error e of a cycle (tangent vector) is normal with covariance
///     v_R C_R + v_t C_t + v_c S,
/// where C_R and C_t are what claimed rotation and translation noise of the steps add up to along
/// the chain, to first order with lever arms, and S is the claimed covariance of the closure; if
/// the closure is false, its rotation is uniform and its end anywhere in a volume twice the
/// trajectory's. The variance factors v are those of the likeliest mixture, with the priors log
/// sqrt(v) ~ N(0, log 3) and log sqrt(v_R / v_t) ~ N(0, log 2): few cycles do not move them far.
/// Variance components: Foerstner, "Ein Verfahren zur Schaetzung von Varianz- und
/// Kovarianzkomponenten", 1979; v_R and v_t are at least 1, and
/// they are 1 unless the odds that odometry is noisier than it claims are 1000 to 1.
///
/// Closures near each other at both ends share most of their chain, and a wrong place has several
/// false closures: they form a place, which counts as one cycle. Deterministic. O(steps +
/// closures).
[[nodiscard]] OdometryNoise estimate_odometry_noise(std::span<const PoseEdge> steps,
                                                    std::span<const PoseEdge> closures);

}  // namespace km
