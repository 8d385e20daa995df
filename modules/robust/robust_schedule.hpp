#pragma once

#include <cstdint>

namespace km {

/// The weight in [0, 1] that minimises w r^2 + mu (1 - w) / (mu + w) c^2. This is the
/// Black-Rangarajan form of the surrogate for min(r^2, c^2), convex for mu -> 0 and truncated for
/// mu -> infinity (Yang et al., "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020,
/// Eq. (14) and Sec. III-B, truncated least squares). 1 up to r^2 = mu c^2 / (mu + 1), 0 from (mu +
/// 1) c^2 / mu on.
[[nodiscard]] double robust_weight(double squared_residual, double squared_barc, double mu);

/// The initial mu, c^2 / (2 r^2 - c^2) with the largest residual r (ibid., Remark 5). Weights are
/// zero only from a squared residual of 2 r^2 on, so that at first all closures have an influence.
/// kLargestMu if r is below c / sqrt(2): then no residual exceeds c.
[[nodiscard]] double first_mu(double largest_squared_residual, double squared_barc);

inline constexpr double kLargestMu = 1e30;

/// Square root of the 99.9999 % quantile of the chi-squared distribution with the degrees of
/// freedom of a pose, 6 or (dimension 2) 3. In the plane the cost counts rotations twice (see
/// planar_precision_of()), so that the limit on the rotation of an inlier is slightly stricter.
[[nodiscard]] double default_threshold(int dimension);

/// Schedule of graduated non-convexity: it decides when mu increases and when the weights are
/// final. Only the root of the tree runs it, on the sums of the team. A weighing sets the weights
/// of all closures at the present poses. There is one step of the poses between two weighings.
class RobustSchedule {
 public:
  /// Sums of the team over the last weighing.
  struct Tally {
    std::uint32_t changed = 0;     ///< Number of weights that have changed.
    std::uint32_t fractional = 0;  ///< Number of weights strictly between 0 and 1.
  };

  /// Begins with the closures that may be rejected: their number is `open_edges`, and their largest
  /// residual is `largest_residual` [sigma]. If `open_edges` is zero, all weights are final.
  /// `barc`: largest residual of an inlier [sigma].
  void start(float largest_residual, std::uint32_t open_edges, double barc);
  /// To be called once per accepted step of the poses, with the sums of the last weighing.
  /// Increases mu or ends the schedule.
  void next(const Tally& tally);
  /// To be called if the converged poses contradict the decided weights: repeats the weighing by
  /// which they became 0 or 1. False if the limit of repetitions is reached.
  [[nodiscard]] bool reopen();

  [[nodiscard]] bool decided() const { return decided_; }
  /// True while the surrogate cost is nearly convex.
  [[nodiscard]] bool is_nearly_convex() const;
  [[nodiscard]] double mu() const { return mu_; }

 private:
  double mu_ = 0.0;
  std::uint32_t open_ = 0;  // closures that may be rejected
  int updates_ = 0;
  int hard_updates_ = 0;  // updates since mu exceeded kHardMu
  int reopened_ = 0;
  bool decided_ = true;
};

/// From this mu on, weights are rounded to 0 or 1: a weight strictly between them needs a residual
/// within half a percent of barc.
inline constexpr double kHardMu = 100.0;

}  // namespace km
