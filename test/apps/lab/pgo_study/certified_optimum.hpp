#pragma once

#include <catch2/catch.hpp>

#include "apps/lab/pgo_study/staircase.hpp"
#include "apps/lab/pgo_study/team_graph.hpp"
#include "modules/pose_graph/chordal.hpp"

namespace km {

/// Relative effect of single precision on a cost. A rounded pose has a relative error of 6e-8, and
/// squared residuals have twice that, times their weights.
inline constexpr double kSinglePrecision = 1e-6;

inline double certified_optimum_of(const TeamGraph& graph) {
  Staircase staircase(graph.edges, lift(chordal_initialisation(graph.poses(), graph.edges), 3));
  while (staircase.step()) {
  }
  REQUIRE(staircase.certificate()->certified);
  return staircase.cost();
}

}  // namespace km
