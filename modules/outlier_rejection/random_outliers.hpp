#pragma once

#include <cstddef>
#include <random>
#include <vector>

#include "modules/core/pose_graph.hpp"

namespace km {

/// Distribution of false closures.
struct RandomOutlierModel {
  RobotId robot = 0;
  std::size_t keyframes = 0;  ///< Number of keyframes of the robot, which contain both ends.
  bool planar = false;        ///< In the plane: no motion along z, no roll and pitch.
  double half_side_m = 20.0;  ///< Translations are uniform in a cube (square) of twice this side.
  Matrix6 covariance = Matrix6::Identity();  ///< Covariance that an outlier states.
};

/// `count` closures between uniform pairs of non-consecutive keyframes with uniform rotation: what
/// is added to benchmark graphs to test outlier rejection. Throws std::invalid_argument for fewer
/// than three keyframes.
[[nodiscard]] std::vector<RelativePose> random_outliers(std::size_t count,
                                                        const RandomOutlierModel& model,
                                                        std::mt19937& rng);

}  // namespace km
