#pragma once

#include <map>
#include <set>
#include <vector>

#include "modules/outlier_rejection/cycle_test.hpp"

namespace km {

/// Finds closures that stronger ones beside them contradict.
///
/// Rows of equal things, such as tents or shelves, yield closures that are shifted by one of them.
/// Such a closure fits much of the odometry, and the graph around it may bend. But beside it there
/// are usually closures at the right place with more inliers: all points fit there, and only those
/// of the repeated things fit elsewhere.
///
/// The closures beside a closure have both ends within kNear keyframes of its own. Those whose
/// cycle with it closes support it; the others contradict it. A closure is overruled if one that
/// contradicts it has kRatio times its support, which is the sum of the inliers of itself and of
/// those that support it. Closures that do not state their inliers (0) have no support and overrule
/// nothing. Errors of both closures and of the odometry may be kNoise times as large as stated:
/// what they overrule errs grossly. Not thread-safe. Copyable.
class LocalContest {
 public:
  static constexpr KeyframeIndex kNear = 10;
  static constexpr double kRatio = 2.0;
  static constexpr double kNoise = 3.0;

  /// Throws ConfigError if `config` is out of bounds.
  explicit LocalContest(const PcmConfig& config);

  /// Adds a closure. Precondition: it is_usable(), and all are between the same two robots.
  void add(const Closure& closure);

  /// Removes all closures but those of `kept`.
  void keep(const std::set<ClosureId>& kept);

  /// Largest support of a closure so far; 0 without one.
  [[nodiscard]] double most_support() const { return most_support_; }

  /// False for closures that were not added.
  [[nodiscard]] bool is_overruled(const ClosureId& closure) const;

 private:
  struct Entry {
    PreparedClosure closure;
    double inliers = 0.0;
    double support = 0.0;
    std::vector<ClosureId> against = {};  // closures that contradict it
  };
  void weigh(Entry& added);

  CycleTest test_;
  std::map<ClosureId, Entry> entries_;
  double most_support_ = 0.0;
};

}  // namespace km
