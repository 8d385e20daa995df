#pragma once

#include <algorithm>
#include <limits>
#include <optional>

namespace km {

/// Tokens that arrive at a constant rate. Spending more than are available makes a debt, which
/// later tokens pay first. Over any time t after a moment without debt, at most per_second * t +
/// capacity are spent, plus the excess of the last spending. Deterministic: time comes in [s], with
/// any origin, and does not decrease.
class TokenBucket {
 public:
  /// `per_second` is positive; infinite: it is always full. It begins with `level`.
  TokenBucket(double per_second, double capacity, double level)
      : per_second_(per_second), capacity_(capacity), level_(level) {}

  /// How long after `now_s` it will hold `amount`, at most its capacity, if nothing is spent.
  [[nodiscard]] double wait_s(double amount, double now_s) {
    fill(now_s);
    return level_ >= amount ? 0.0 : (amount - level_) / per_second_;
  }

  void spend(double amount, double now_s) {
    fill(now_s);
    level_ -= amount;
  }

 private:
  void fill(double now_s) {
    if (per_second_ == std::numeric_limits<double>::infinity()) level_ = capacity_;
    if (filled_s_ && now_s > *filled_s_)
      level_ = std::min(capacity_, level_ + per_second_ * (now_s - *filled_s_));
    filled_s_ = now_s;
  }

  double per_second_;
  double capacity_;
  double level_;  // level at the time filled_s_
  std::optional<double> filled_s_;
};

}  // namespace km
