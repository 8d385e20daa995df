#include "modules/robust/robust_schedule.hpp"

#include <algorithm>
#include <cmath>

#include "modules/outlier_rejection/chi_squared.hpp"

namespace km {
namespace {

constexpr double kInlierProbability = 0.999999;
constexpr double kMuStep = 1.4;
// While the surrogate is nearly convex, mu may increase faster.
constexpr double kFirstMuStep = 2.5;
constexpr double kNearlyConvex = 0.05;
// Once so few closures are undecided, mu may increase faster, too.
constexpr double kLastMuStep = 10.0;
constexpr double kMostlyDecided = 0.1;  // share of fractional weights
constexpr int kMaxUpdates = 100;        // weights are final afterwards
// A few more updates let borderline weights settle.
constexpr int kHardUpdates = 3;
constexpr int kMaxReopened = 3;

}  // namespace

double robust_weight(double squared_residual, double squared_barc, double mu) {
  if (mu >= kHardMu) return squared_residual <= squared_barc ? 1.0 : 0.0;
  if (squared_residual * (mu + 1.0) <= mu * squared_barc) return 1.0;
  if (!(squared_residual * mu < (mu + 1.0) * squared_barc)) return 0.0;  // also if not a number
  return std::clamp(std::sqrt(mu * (mu + 1.0) * squared_barc / squared_residual) - mu, 0.0, 1.0);
}

double first_mu(double largest_squared_residual, double squared_barc) {
  const double beyond = 2.0 * largest_squared_residual - squared_barc;
  return beyond > 0.0 ? std::min(kLargestMu, squared_barc / beyond) : kLargestMu;
}

double default_threshold(int dimension) {
  return std::sqrt(pose_quantile(kInlierProbability, dimension));
}

void RobustSchedule::start(float largest_residual, std::uint32_t open_edges, double barc) {
  decided_ = open_edges == 0;
  open_ = open_edges;
  mu_ = first_mu(static_cast<double>(largest_residual) * largest_residual, barc * barc);
  updates_ = 1;
  hard_updates_ = mu_ >= kHardMu ? 1 : 0;
}

void RobustSchedule::next(const Tally& tally) {
  if (decided_) return;
  const bool same = tally.changed == 0;
  const bool hard = mu_ >= kHardMu;
  decided_ = (same && (tally.fractional == 0 || hard)) || (hard && hard_updates_ >= kHardUpdates) ||
             updates_ >= kMaxUpdates;
  if (decided_) return;
  ++updates_;
  const double step = is_nearly_convex()                           ? kFirstMuStep
                      : tally.fractional <= kMostlyDecided * open_ ? kLastMuStep
                                                                   : kMuStep;
  mu_ = std::min(kLargestMu, mu_ * step);
  if (mu_ >= kHardMu) ++hard_updates_;
}

bool RobustSchedule::is_nearly_convex() const {
  return mu_ < kNearlyConvex;
}

bool RobustSchedule::reopen() {
  if (reopened_ >= kMaxReopened || updates_ == 0) return false;
  ++reopened_;
  decided_ = false;
  mu_ = kLargestMu;
  hard_updates_ = 1;
  return true;
}

}  // namespace km
