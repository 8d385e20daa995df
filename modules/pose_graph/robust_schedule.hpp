#pragma once

#include <cstdint>

namespace km {

/// The weight in [0, 1] that minimises w r^2 + mu (1 - w) / (mu + w) c^2: Black-Rangarajan form of
/// the surrogate for min(r^2, c^2), which is convex for mu -> 0 and truncated for mu -> infinity
/// (Yang et al., "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020, Eq. (14) and
/// Sec. III-B, truncated least squares). 1 up to r^2 = mu c^2 / (mu + 1), 0 from (mu + 1) c^2 / mu
/// on.
[[nodiscard]] double robust_weight(double squared_residual, double squared_barc, double mu);

/// The mu to begin with, c^2 / (2 r^2 - c^2) of the largest residual r (ibid., Remark 5): weights
/// are zero from 2 r^2 on, so that all closures have a say. kLargestMu if r is below c / sqrt(2):
/// then none is outside.
[[nodiscard]] double first_mu(double largest_squared_residual, double squared_barc);

inline constexpr double kLargestMu = 1e30;

/// Square root of the 99.9999 % quantile of the chi-squared distribution with as many degrees of
/// freedom as a pose has, 6 or (dimension 2) 3. In the plane the cost counts rotations twice (see
/// precision_of_blocks()), so an inlier there is turned a little less.
[[nodiscard]] double default_threshold(int dimension);

/// When the surrogate gets steeper, and when all is decided: run by the root of the tree alone, on
/// the team's sums. Between two weighings there is one step of the poses.
class RobustSchedule {
 public:
  /// What the team says of the last weighing.
  struct Tally {
    std::uint32_t changed = 0;     ///< Weights that have changed.
    std::uint32_t fractional = 0;  ///< Weights strictly between 0 and 1.
  };

  /// `largest` residual [sigma] of what may be rejected; none if `open` is zero: all is decided
  /// then. The first `all_in` steps are made before anything is weighed.
  void start(float largest, std::uint32_t open, double barc, int all_in);
  /// To be called once per accepted step of a weighing.
  void next(const Tally& tally);
  /// After a decision, where the poses that it led to contradict it: hard weights once more. False
  /// if that has been done often enough.
  [[nodiscard]] bool reopen();

  [[nodiscard]] bool all_in() const { return all_in_ > 0; }
  [[nodiscard]] bool decided() const { return decided_; }
  [[nodiscard]] double mu() const { return mu_; }

 private:
  double mu_ = 0.0;
  int all_in_ = 0;
  int updates_ = 0;
  int hard_updates_ = 0;  // since mu is so large that no weight lies between 0 and 1
  int reopened_ = 0;
  bool decided_ = true;
};

/// From here on weights are rounded to 0 or 1: one strictly between them needs a residual within
/// half a percent of barc.
inline constexpr double kHardMu = 100.0;

}  // namespace km
