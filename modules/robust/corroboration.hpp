#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "modules/robust/closure_noise.hpp"
#include "modules/robust/noise_histogram.hpp"
#include "modules/robust/odometry_cycles.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

/// Agreement between the closures of one pair of robots (or inside one robot), before any
/// optimisation. Robots usually meet for some time. A true closure therefore has other closures
/// near it that agree with it along the odometry between them; a false one rarely has. Both robots
/// of the pair know all inputs (poses and weights), so both compute the same result.
class Corroboration {
 public:
  using PoseOf = std::function<SE3(const KeyframeId&)>;

  /// `closures`: of one pair of robots. `pose`: where their ends are, by odometry or by an earlier
  /// optimisation. `step`: mean weights of an odometry step of each robot. For a robot without an
  /// entry they are 1, and in isolated() those of the closure. `dimension` 2: poses are planar. All
  /// arguments must outlive this object. No cycle contains the step to a run in `later_runs`.
  Corroboration(std::span<const PoseEdge> closures, const PoseOf& pose,
                const std::map<RobotId, Precision>& step, int dimension, LaterRuns later_runs = {});

  /// Counts the Mahalanobis lengths of cycles through two closures whose ends are a few keyframes
  /// apart on both robots, and the odometry between them. It counts at most `most` cycles: those
  /// with the fewest steps of odometry, chosen evenly among equals. Cycles whose rotation error
  /// exceeds 45 degrees are left out, because most of them contain a false closure. An error that
  /// both closures share cancels in the cycle.
  void count_lengths(NoiseHistogram& histogram, std::size_t most) const;

  /// Adds the cycles that estimate_closure_noise() needs: at most kMostNoiseCycles through two
  /// closures of one place, and as many through the first closures of two places (see
  /// find_places()), chosen as above. The translation variance of n steps over a distance L
  /// includes the lever arm of their rotation noise: n (sigma_t^2 + sigma_R^2 L^2 / 3).
  void count_cycles(PairCycles& cycles) const;
  static constexpr std::size_t kMostNoiseCycles = 150;

  /// Marks the closures that stand alone: no closure near them agrees with them up to `barc`
  /// [sigma], given the noise of both closures and of the odometry between them.
  [[nodiscard]] std::vector<bool> isolated(double barc) const;

  /// Marks the closures without `kept` that the drift of odometry may explain. `pose` is a solution
  /// without them, and the error of a closure is its error there. Its covariance is that of the
  /// path along odometry over the nearest kept closure; inside one robot also along odometry alone.
  /// The solution is more precise than this path, so the median of the path is the limit.
  [[nodiscard]] std::vector<bool> possible(const std::vector<bool>& kept) const;

 private:
  // A closure, directed from its end on the first robot of the pair (see first_robot()) to the
  // other one; inside a robot from the earlier keyframe to the later one.
  struct Upward {
    std::size_t index = 0;  // index in edges_
    KeyframeId lower;
    KeyframeId upper;
    SE3 T_lower_upper;
    Precision precision;
  };

  // Two closures with few steps of odometry between them, by their indices in closures_.
  struct Near {
    std::uint32_t steps = 0;
    std::size_t a = 0;
    std::size_t b = 0;
  };

  [[nodiscard]] static std::vector<Near> nearest(std::vector<Near> cycles, std::size_t most);
  [[nodiscard]] Precision step_of(RobotId robot, const Precision& otherwise = {}) const;
  // `levers`: the covariance of odometry contains the lever arms of its rotations.
  [[nodiscard]] TwoClosureCycle cycle_of(const Upward& one, const Upward& other, bool levers) const;
  [[nodiscard]] bool same_runs(const Upward& one, const Upward& other) const;
  [[nodiscard]] double cycle_length(const Upward& one, const Upward& other) const;
  [[nodiscard]] NoiseCycle noise_cycle(const Upward& one, const Upward& other, double volume) const;
  [[nodiscard]] double turn_rad(const Upward& one, const Upward& other) const;
  [[nodiscard]] double volume() const;
  [[nodiscard]] bool agree(const Upward& one, const Upward& other, double barc) const;

  const PoseOf& pose_;
  const std::map<RobotId, Precision>& step_;
  int dimension_;
  LaterRuns later_runs_;
  std::span<const PoseEdge> edges_;
  std::vector<Upward> closures_;  // ascending by the lower end
};

}  // namespace km
