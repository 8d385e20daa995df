#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <vector>

namespace km {

/// Distribution of durations in bounded memory: counts per bucket, each 1 % wider than the one
/// before, from 100 ns to 1000 s. Quantiles are within 0.5 % of the exact ones; the number, the sum
/// and the extremes are exact. Not thread-safe.
class DurationHistogram {
 public:
  void add(double seconds);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double total_s() const { return total_s_; }
  [[nodiscard]] double max_s() const { return max_s_; }

  /// Smallest duration that at least a share `p` of all durations do not exceed; p in (0, 1]. Zero
  /// without durations.
  [[nodiscard]] double quantile_s(double p) const;

 private:
  std::vector<std::uint64_t> buckets_;
  std::uint64_t count_ = 0;
  double total_s_ = 0.0;
  double min_s_ = 0.0;
  double max_s_ = 0.0;
};

/// Durations of one kind of work. Thread-safe.
class Timing {
 public:
  void add(double seconds);
  [[nodiscard]] DurationHistogram histogram() const;

  /// Measures the time to the end of a scope.
  class Scope {
   public:
    explicit Scope(Timing& timing) : timing_(timing), start_(std::chrono::steady_clock::now()) {}
    ~Scope() {
      timing_.add(std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count());
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Timing& timing_;
    std::chrono::steady_clock::time_point start_;
  };
  [[nodiscard]] Scope measure() { return Scope(*this); }

 private:
  mutable std::mutex mutex_;
  DurationHistogram histogram_;
};

}  // namespace km
