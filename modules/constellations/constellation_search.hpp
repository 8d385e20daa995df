#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "modules/constellations/constellation_match.hpp"
#include "modules/constellations/object_stretches.hpp"
#include "modules/core/data/pose_graph.hpp"

namespace km {

/// Finds places that this robot has in common with robots with higher ids, by the constellations of
/// their objects. A place is a closure between two keyframes, which the back-end judges like any
/// other one. No relative pose needs to be known.
///
/// Information hardly counts twice: a closure whose keyframes are both within kStretchRadius_m of
/// those of another one is not made. Its stretches would share most objects, or images measured the
/// same place better.
///
/// Not thread-safe. The result depends on the order of the calls.
class ConstellationSearch {
 public:
  static constexpr double kCalm_s = 2.0;  ///< Time without changes after which a stretch is used.

  /// Largest standard deviation of the position of a closure along one axis. A weaker one moves no
  /// graph.
  static constexpr double kMaxSigma_m = 1.0;

  /// Numbers of searches by their result.
  using Counts = std::map<ConstellationStatus, std::size_t>;

  explicit ConstellationSearch(RobotId self) : self_(self) {}

  /// The objects of this robot or of another one: they replace its former objects.
  void add(const RobotObjects& objects, double now_s);
  /// Any closure, also those that step() returned.
  void add(const Closure& closure);
  /// Discards everything about a restarted robot.
  void forget(RobotId robot);

  /// At most one match, and the closure to which the matches so far lead, if any.
  [[nodiscard]] std::optional<Closure> step(double now_s);

  /// True if step() has nothing left to do with the present objects, also later. After a change, it
  /// is false until the next step().
  [[nodiscard]] bool is_done() const { return is_done_; }

  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  struct Stretch {
    ObjectStretch objects;
    std::uint64_t version = 0;
    double changed_s = 0.0;
  };
  // Keyframes of a stretch of this robot and of one of another robot.
  using PairId = ClosureId;
  // Both ends of a closure.
  struct Place {
    OdometryPose own, peer;
  };

  [[nodiscard]] bool is_known_place(const OdometryPose& own, const OdometryPose& peer) const;
  [[nodiscard]] bool is_tried(const Stretch& own, const Stretch& peer) const;
  [[nodiscard]] std::optional<Closure> match(const Stretch& own, const Stretch& peer);
  [[nodiscard]] std::optional<Closure> take_best();

  const RobotId self_;
  const ConstellationOptions options_;
  std::map<RobotId, std::vector<Stretch>> stretches_;
  std::uint64_t changes_ = 0;
  std::map<PairId, std::uint64_t> tried_;  // newest version of both stretches at the last match
  std::map<PairId, Closure> found_;        // not yet taken
  std::map<ClosureId, Place> places_;      // all closures of this robot with others
  Counts counts_;
  bool is_done_ = true;
};

/// The closure for T_a_b, the pose of the frame of b's landmarks in that of a's. It is between
/// those keyframes of the stretches that are nearest to the middle of the matched landmarks. The
/// covariance grows by the drift between the keyframes and this middle.
[[nodiscard]] Closure closure_of(const ObjectStretch& a, const ObjectStretch& b,
                                 const ConstellationMatch& match);

}  // namespace km
