#include "runtime/metrics.hpp"

#include <algorithm>
#include <cmath>

namespace km {
namespace {

constexpr double kSmallest_s = 1e-7;
constexpr double kLargest_s = 1e3;
constexpr double kGrowth = 1.01;

std::size_t bucket_of(double seconds) {
  const double clamped = std::clamp(seconds, kSmallest_s, kLargest_s);
  return static_cast<std::size_t>(std::log(clamped / kSmallest_s) / std::log(kGrowth));
}

// Geometric middle, which differs from each duration in the bucket by at most 0.5 %.
double middle_of(std::size_t bucket) {
  return kSmallest_s * std::pow(kGrowth, static_cast<double>(bucket) + 0.5);
}

}  // namespace

void DurationHistogram::add(double seconds) {
  if (buckets_.empty()) buckets_.resize(bucket_of(kLargest_s) + 1);
  ++buckets_[bucket_of(seconds)];
  min_s_ = count_ == 0 ? seconds : std::min(min_s_, seconds);
  max_s_ = std::max(max_s_, seconds);
  total_s_ += seconds;
  ++count_;
}

double DurationHistogram::quantile_s(double p) const {
  if (count_ == 0) return 0.0;
  const auto rank = static_cast<std::uint64_t>(
      std::clamp(std::ceil(p * static_cast<double>(count_)), 1.0, static_cast<double>(count_)));
  std::uint64_t below = 0;
  std::size_t bucket = 0;
  while ((below += buckets_[bucket]) < rank) ++bucket;
  return std::clamp(middle_of(bucket), min_s_, max_s_);
}

void Timing::add(double seconds) {
  const std::lock_guard lock(mutex_);
  histogram_.add(seconds);
}

DurationHistogram Timing::histogram() const {
  const std::lock_guard lock(mutex_);
  return histogram_;
}

}  // namespace km
