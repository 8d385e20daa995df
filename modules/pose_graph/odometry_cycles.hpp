#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/pose_graph/pose_edge.hpp"

namespace km {

/// A cycle of a closure inside a robot and the steps of odometry between its ends.
struct OdometryCycle {
  /// Sources of its noise: rotations and translations of the steps, and the closure.
  enum Component : std::size_t { kRotation, kTranslation, kClosure, kComponents };

  PoseEdge closure;
  std::size_t lower = 0;  ///< Keyframes at its ends.
  std::size_t upper = 0;
  /// Tangent vector at the upper keyframe, from its pose by the closure to its pose by the steps.
  Vector6 error = Vector6::Zero();
  std::array<Matrix6, kComponents> covariance = {};  ///< Claimed covariance of `error`, by source.
  double weight = 1.0;                               ///< Number of independent observations.

  [[nodiscard]] Matrix6 claimed() const {
    return covariance[kRotation] + covariance[kTranslation] + covariance[kClosure];
  }
};

/// The odometry of one robot, from its first keyframe.
class OdometryChain {
 public:
  /// `steps[k]` is from keyframe k to keyframe k + 1.
  explicit OdometryChain(std::span<const PoseEdge> steps);

  /// The cycle from the lower end along the steps to the upper one, and back by the closure.
  /// Precondition: both ends are keyframes of the chain.
  [[nodiscard]] OdometryCycle close(const PoseEdge& closure) const;

  std::vector<SE3> T_first_kf{SE3::Identity()};

 private:
  // Claimed covariance of the steps up to each keyframe, as perturbations of the first pose. The
  // difference of two keyframes is the covariance of the chain between them.
  std::array<std::vector<Matrix6>, 2> covariance_{std::vector{Matrix6(Matrix6::Zero())},
                                                  std::vector{Matrix6(Matrix6::Zero())}};
};

}  // namespace km
