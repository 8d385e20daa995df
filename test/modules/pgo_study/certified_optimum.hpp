#pragma once

#include <catch2/catch.hpp>

#include "modules/pgo_study/staircase.hpp"
#include "modules/pgo_study/team_graph.hpp"
#include "modules/pose_graph/chordal.hpp"

namespace km {

/// A rounded pose is off by 6e-8 of itself, squared residuals by twice that and their weights.
inline constexpr double kSinglePrecision = 1e-6;

inline double certified_optimum_of(const TeamGraph& graph) {
  Staircase staircase(graph.edges, lift(chordal_initialisation(graph.poses(), graph.edges), 3));
  while (staircase.step()) {
  }
  REQUIRE(staircase.certificate()->certified);
  return staircase.cost();
}

}  // namespace km
