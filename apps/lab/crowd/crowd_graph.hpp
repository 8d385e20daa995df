#pragma once

#include <cstddef>
#include <cstdint>

#include "apps/lab/pgo_study/team_graph.hpp"

namespace km {

/// A pose graph of a team whose overlap does not depend on its size.
struct CrowdGraphOptions {
  std::size_t robots = 10;
  std::size_t keyframes = 1000;  ///< Number for each robot, 0.5 m apart.
  std::size_t partners = 4;      ///< Robots with which each robot has closures: its neighbours on a
                                 ///< ring, even and below `robots`.
  std::size_t closures = 24;     ///< Between two such robots.
  std::size_t own_closures = 50;  ///< Inside each robot.
  std::uint32_t seed = 1;
};

/// Each robot drives laps of a circle of 20 m radius, with centres 15 m apart on a ring. Closures
/// join keyframes of two robots where their circles cross, and keyframes of one robot a lap or more
/// apart. All measurements have Gaussian noise as claimed: steps 2 mrad and 5 mm per axis, closures
/// 5 mrad and 30 mm. Throws std::invalid_argument if `options` are out of bounds.
[[nodiscard]] TeamGraph crowd_graph(const CrowdGraphOptions& options);

}  // namespace km
