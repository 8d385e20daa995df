#pragma once

#include <cstddef>
#include <random>
#include <vector>

#include "modules/core/pose_graph.hpp"

namespace km {

/// Distribution of false closures.
struct RandomOutlierModel {
  RobotId robot = 0;
  std::size_t keyframes = 0;  ///< Number of keyframes of the robot.
  bool planar = false;        ///< No translation along z, no roll and pitch.
  double half_side_m = 20.0;  ///< Half the side of the cube (planar: square) of translations.
  Matrix6 covariance = Matrix6::Identity();  ///< Covariance of every outlier.
};

/// `count` false closures for tests of outlier rejection. The pairs of non-consecutive keyframes,
/// the rotations and the translations are uniform. Throws std::invalid_argument for fewer than
/// three keyframes.
[[nodiscard]] std::vector<RelativePose> random_outliers(std::size_t count,
                                                        const RandomOutlierModel& model,
                                                        std::mt19937& rng);

}  // namespace km
