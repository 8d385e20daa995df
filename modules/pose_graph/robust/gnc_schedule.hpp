#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"

namespace km {

/// Graduated non-convexity with truncated least squares: of a graph's edges, those whose residual r
/// [sigma] can be brought below a threshold c, "barc", stay.
struct GncOptions {
  double barc = 0.0;     ///< Largest residual of an inlier [sigma]; 0: default_barc().
  double mu_step = 1.4;  ///< Factor by which the surrogate comes closer to the truncated cost, > 1.
  int max_updates = 100;  ///< Of the weights; then they are decided as they are.
};

/// Throws std::invalid_argument, naming what is out of bounds.
void check(const GncOptions& options);

/// Square root of the 99 % quantile of the chi-squared distribution with as many degrees of freedom
/// as a pose has, 6 or (dimension 2) 3. In the plane the cost counts rotations twice
/// (see precision_of_blocks()), so an inlier there is turned a little less.
[[nodiscard]] double default_barc(int dimension);

/// The weight in [0, 1] that minimises w r^2 + mu (1 - w) / (mu + w) c^2: Black-Rangarajan form of
/// the surrogate for min(r^2, c^2), which is convex for mu -> 0 and truncated for mu -> infinity
/// (Yang et al., "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020, truncated
/// least squares). 1 up to r^2 = mu c^2 / (mu + 1), 0 from (mu + 1) c^2 / mu on.
[[nodiscard]] double gnc_weight(double squared_residual, double squared_barc, double mu);

/// The mu at which the surrogate is convex up to the largest residual (ibid.): c^2 / (2 r^2 - c^2),
/// and infinite if that residual is below c / sqrt(2): then nothing is truncated.
[[nodiscard]] double gnc_first_mu(double largest_squared_residual, double squared_barc);

/// An edge that may be rejected.
struct GncCandidate {
  RobotId a = 0;  ///< The robots of its ends; may be the same.
  RobotId b = 0;
  /// Part of a robot's odometry. It is never dropped altogether, because it holds the trajectory
  /// together: when rejected it keeps a weight of kJointWeight.
  bool odometry = false;
};

inline constexpr double kJointWeight = 1e-6;

/// The decisions of graduated non-convexity, made from told residuals alone: whoever has the same
/// residuals makes the same decisions. Weights and poses are found in turn, by update() and by the
/// owner, who minimises the cost with these weights.
///
/// Robots that all closures between them are rejected of fall apart. To have a frame for all, the
/// candidate of least residual between two such parts is still used, but counts as rejected: alone
/// it bends nothing. Not thread-safe.
class GncSchedule {
 public:
  /// `joined` are pairs of robots with trusted edges between them.
  GncSchedule(std::vector<GncCandidate> candidates, std::size_t robots,
              std::vector<GncCandidate> joined, const GncOptions& options, int dimension);

  /// Sets the weights for these residuals [sigma], one per candidate. False, and nothing changed,
  /// if they were decided before: the poses that the residuals come from are the last ones.
  /// Throws std::invalid_argument if their number is another or one is negative or not a number.
  bool update(std::span<const float> residuals);

  /// Weight to be used for a candidate, 0: not at all.
  [[nodiscard]] double weight(std::size_t candidate) const { return weights_[candidate]; }
  /// Whether it is an inlier, as things stand.
  [[nodiscard]] bool kept(std::size_t candidate) const {
    return weights_[candidate] >= 0.5 && !bridge_[candidate];
  }
  /// All weights are decided: only the poses that belong to them are to be found.
  [[nodiscard]] bool decided() const { return decided_; }
  [[nodiscard]] int updates() const { return updates_; }
  [[nodiscard]] double mu() const { return mu_; }
  [[nodiscard]] double barc() const { return barc_; }

 private:
  void set_weights(std::span<const float> residuals);
  void join_parts(std::span<const float> residuals);

  std::vector<GncCandidate> candidates_;
  std::vector<GncCandidate> joined_;
  std::size_t robots_;
  GncOptions options_;
  double barc_;
  double mu_ = 0.0;
  int updates_ = 0;
  int hard_updates_ = 0;  // since mu is so large that no weight lies between 0 and 1
  bool decided_ = false;
  std::vector<double> weights_;
  std::vector<bool> bridge_;
};

}  // namespace km
