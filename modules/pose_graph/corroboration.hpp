#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "modules/pose_graph/closure_noise.hpp"
#include "modules/pose_graph/noise_histogram.hpp"
#include "modules/pose_graph/pose_edge.hpp"

namespace km {

/// The covariance that the weights of an edge stand for, tangent [rotation; translation]. In the
/// plane (`dimension` 2) kappa is that of the angle (see precision_of_blocks()), and other
/// directions have none.
[[nodiscard]] Matrix6 covariance_in(const Precision& precision, int dimension);

/// What the closures of one pair of robots (or inside one robot) say of each other, before anything
/// is optimised. Robots that meet do so for a while, so that a true closure mostly has others
/// beside it that agree with it along the odometry between; a false one rarely has. From poses and
/// weights that both robots were told, so that both come to the same.
class Corroboration {
 public:
  using PoseOf = std::function<SE3(const KeyframeId&)>;

  /// `closures` of one pair of robots; `pose` where their ends are by odometry or by what was
  /// optimised before; `step` the mean weights of a step of either robot's odometry (of robots that
  /// are not in it: 1). `dimension` 2: poses are planar. All must outlive it.
  Corroboration(std::span<const PoseEdge> closures, const PoseOf& pose,
                const std::map<RobotId, Precision>& step, int dimension);

  /// Counts the Mahalanobis lengths of cycles through two closures a few keyframes apart at both
  /// ends and the odometry between; those with least odometry first, and not more than
  /// `most`. Cycles that turn by more than 45 degrees, as most with a false closure do, are left
  /// out. What two closures beside each other have in common does not show.
  void count_lengths(NoiseHistogram& histogram, std::size_t most) const;

  /// Adds the cycles that estimate_closure_noise() needs: at most kMostNoiseCycles through two
  /// closures of one place, and as many through the first closures of two places (see
  /// find_places()), those with the fewest steps of odometry first. The covariance of n steps over
  /// a distance L has the lever arm of their rotation noise: n (sigma_t^2 + sigma_R^2 L^2 / 3).
  void count_cycles(PairCycles& cycles) const;
  static constexpr std::size_t kMostNoiseCycles = 150;

  /// Which closures stand alone: none beside them agrees up to `barc` [sigma], allowing for the
  /// noise of both and of the steps between.
  [[nodiscard]] std::vector<bool> isolated(double barc) const;

 private:
  struct Upward {  // from the lower end to the upper one
    std::size_t place = 0;
    KeyframeId lower;
    KeyframeId upper;
    SE3 T_lower_upper;
    Precision precision;
  };

  [[nodiscard]] double cycle_length(const Upward& one, const Upward& other) const;
  [[nodiscard]] NoiseCycle noise_cycle(const Upward& one, const Upward& other, double volume) const;
  [[nodiscard]] double volume() const;
  [[nodiscard]] bool agree(const Upward& one, const Upward& other, double barc) const;

  const PoseOf& pose_;
  const std::map<RobotId, Precision>& step_;
  int dimension_;
  std::span<const PoseEdge> edges_;
  std::vector<Upward> closures_;  // ascending by the lower end
};

}  // namespace km
