#pragma once

#include <map>

#include "modules/core/data/pose_graph.hpp"

namespace km {

/// Probability that a candidate leads to a closure, learned from the results of other candidates
/// of the same peer.
///
/// Right candidates are more similar. They also come in groups, because the views around the match
/// resemble the query too. In all recordings that were measured (README, Requests), similarity and
/// support change the odds by equal factors, but the share of right candidates differs. So the
/// probability is a logistic function with fixed slopes and one unknown, the difficulty d of the
/// environment:
///
///   p = 1 / (1 + exp(d - z)),  z = 11.7 similarity + 1.1 min(support, 5).
///
/// d is the maximum of its posterior distribution. Before the first result, d has a normal
/// distribution with a mean of 14 and a standard deviation of 2.
class ClosureOdds {
 public:
  [[nodiscard]] double probability(const LoopCandidate& candidate) const;

  /// Notes whether a candidate has led to a closure.
  void add(const LoopCandidate& candidate, bool verified);

 private:
  struct Results {
    double all = 0.0;
    double closures = 0.0;
  };

  std::map<int, Results> results_;  ///< By 4 z, rounded.
  double difficulty_ = kFirstDifficulty;

  // The recordings have difficulties from 13.5 to 19. The mean is below most of them, because
  // without requests nothing is learned.
  static constexpr double kFirstDifficulty = 14.0;
  static constexpr double kFirstVariance = 4.0;
};

}  // namespace km
