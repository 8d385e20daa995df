#include "modules/loop_closure/closure_odds.hpp"

#include <algorithm>
#include <cmath>

namespace km {
namespace {

// Candidates of equal 4 z, rounded, count as equal.
constexpr double kBinsPerUnit = 4.0;

constexpr int kMaxSteps = 50;
constexpr double kTolerance = 1e-6;

double logistic(double x) {
  return 1.0 / (1.0 + std::exp(-x));
}

// At most 40, where every probability is 1: a similarity may have any size.
double evidence(const LoopCandidate& candidate) {
  return std::clamp(11.7 * candidate.similarity + 1.1 * std::min(candidate.support, 5), 0.0, 40.0);
}

}  // namespace

double ClosureOdds::probability(const LoopCandidate& candidate) const {
  return logistic(evidence(candidate) - difficulty_);
}

void ClosureOdds::add(const LoopCandidate& candidate, bool verified) {
  Results& results = results_[static_cast<int>(std::lround(kBinsPerUnit * evidence(candidate)))];
  results.all += 1.0;
  results.closures += verified ? 1.0 : 0.0;
  // Newton's method. The log posterior is concave; a bounded step keeps it from oscillating.
  for (int step = 0; step < kMaxSteps; ++step) {
    double gradient = (kFirstDifficulty - difficulty_) / kFirstVariance;
    double information = 1.0 / kFirstVariance;
    for (const auto& [bin, found] : results_) {
      const double p = logistic(bin / kBinsPerUnit - difficulty_);
      gradient += found.all * p - found.closures;
      information += found.all * p * (1.0 - p);
    }
    const double change = std::clamp(gradient / information, -1.0, 1.0);
    difficulty_ += change;
    if (std::abs(change) < kTolerance) return;
  }
}

}  // namespace km
