#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/data/covariance.hpp"
#include "modules/core/geometry/geometry.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// The covariance that corresponds to the weights of an edge, tangent [rotation; translation]. In
/// the plane (`dimension` 2) kappa is the precision of the angle (see planar_precision_of()), and
/// roll, pitch and z have variance zero.
[[nodiscard]] Matrix6 covariance_in(const Precision& precision, int dimension);

/// The squared Mahalanobis length of a tangent vector and the logarithm of the root of det Sigma;
/// in the plane those of the angle, x and y.
struct MahalanobisLength {
  double squared = 0.0;
  double log_root = 0.0;
};
[[nodiscard]] MahalanobisLength mahalanobis_length(const Vector6& error, const Matrix6& Sigma,
                                                   int dimension);

/// Log density of an error with this covariance.
[[nodiscard]] double log_density_if_true(const Vector6& error, const Matrix6& Sigma, int dimension);

/// The cycle up along one closure, along odometry, down along another closure, and back along
/// odometry. It begins and ends at the lower end of the first closure. Without noise, T() is the
/// identity.
struct TwoClosureCycle {
  UncertainPose up;     ///< One closure, from its lower to its upper end.
  UncertainPose above;  ///< Odometry between the upper ends.
  UncertainPose down;   ///< The other closure, from its upper to its lower end.
  UncertainPose below;  ///< Odometry between the lower ends.

  [[nodiscard]] SE3 T() const { return up.T * above.T * down.T * below.T; }
  // Covariances of T(), in the tangent space at T(): of all noise, or of that of one source.
  [[nodiscard]] Matrix6 covariance() const;
  [[nodiscard]] Matrix6 covariance_of_odometry() const;
  [[nodiscard]] Matrix6 covariance_of_closures() const;
};

/// A cycle along steps of odometry of one robot and one closure, or two closures near each other.
struct OdometryCycle {
  /// Sources of the noise of a cycle: rotations and translations of the steps, its only closure, or
  /// its two closures. An error that two closures of a place share cancels in a cycle through both.
  enum Component : std::size_t { kRotation, kTranslation, kClosure, kTwoClosures, kComponents };

  PoseEdge closure;                    ///< The only closure, or the first one.
  std::optional<PoseEdge> other = {};  ///< The second closure.
  std::size_t lower = 0;               ///< Keyframes at the ends of `closure`.
  std::size_t upper = 0;
  /// Tangent vector at the upper keyframe, from its pose by the closure to its pose by the steps.
  /// With two closures: logarithm of the transform around the whole cycle, from the lower keyframe.
  Vector6 error = Vector6::Zero();
  std::array<Matrix6, kComponents> covariance = {  ///< Claimed covariance of `error`, by source.
      Matrix6::Zero(), Matrix6::Zero(), Matrix6::Zero(), Matrix6::Zero()};
  /// Claimed covariance by the rotations and by the translations of the closures.
  std::array<Matrix6, 2> of_closures = {Matrix6::Zero(), Matrix6::Zero()};
  double weight = 1.0;  ///< Number of independent observations.

  /// Covariance of `error` with odometry as claimed and closures `noise` times noisier.
  [[nodiscard]] Matrix6 claimed(double noise = 1.0) const {
    return covariance[kRotation] + covariance[kTranslation] +
           noise * noise * (covariance[kClosure] + covariance[kTwoClosures]);
  }
};

/// The odometry of one robot, from its first keyframe.
class OdometryChain {
 public:
  /// `steps[k]` is from keyframe k to keyframe k + 1. `dimension` 2: poses are planar.
  OdometryChain(std::span<const PoseEdge> steps, int dimension);

  /// True if all steps between the keyframes are known.
  [[nodiscard]] bool joins(std::size_t a, std::size_t b) const { return run_[a] == run_[b]; }

  /// The cycle from the lower end along the steps to the upper one, and back by the closure.
  /// Precondition: both ends are keyframes of the chain, and it joins() them.
  [[nodiscard]] OdometryCycle close(const PoseEdge& closure) const;
  /// The cycle along closure `one`, the steps to the upper end of closure `other`, back along it,
  /// and the steps to the beginning. Precondition: all ends are keyframes of the chain, and
  /// it joins() both lower ones and both upper ones.
  [[nodiscard]] OdometryCycle close(const PoseEdge& one, const PoseEdge& other) const;

  std::vector<SE3> T_first_kf{SE3::Identity()};

 private:
  [[nodiscard]] UncertainPose upward(const PoseEdge& closure, OdometryCycle::Component part) const;
  [[nodiscard]] UncertainPose steps(std::size_t from, std::size_t to,
                                    OdometryCycle::Component part) const;

  int dimension_;
  std::vector<std::uint32_t> run_{0};  // number of unknown steps before each keyframe
  // Claimed covariance of the steps up to each keyframe, as perturbations of the first pose. The
  // difference of two keyframes is the covariance of the chain between them.
  std::array<std::vector<Matrix6>, 2> covariance_{std::vector{Matrix6(Matrix6::Zero())},
                                                  std::vector{Matrix6(Matrix6::Zero())}};
};

}  // namespace km
