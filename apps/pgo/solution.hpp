#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/pgo/solvers.hpp"
#include "modules/pgo_study/certificate.hpp"

namespace km {

/// What poses are worth, as one computer that has the whole graph sees it.
struct Judgement {
  double rounded_cost = 0.0;
  double optimum = 0.0;  ///< The certified one, or as given; the least cost known if none is.
  bool optimum_certified = false;  ///< Or given.
  Certificate certificate = {};
  Eigen::Index rank = 0;  ///< Numerical, of the rotations; 3 (2 in the plane): no relaxation left.
};

/// What one method did to one graph.
struct Solution {
  std::string method;    ///< SolverOptions::name().
  double start_s = 0.0;  ///< CPU time of the chordal initialisation.
  SolverRun run = {};
  /// Rounded, in the frame of the first pose; z up with verticals.
  std::vector<SE3> T_world_kf = {};
  /// nullopt of a method that rejects: before it has decided there is no optimum to compare with.
  std::optional<Judgement> judgement = {};
};

/// Runs a method from the chordal initialisation, which is computed centrally and not counted, and
/// is levelled by verticals as a whole; what rejects starts from odometry. The optimum is computed
/// if not given. Throws as run_solver() does.
[[nodiscard]] Solution solve(const TeamGraph& graph, const SolverOptions& options,
                             std::optional<double> optimum, const TeamMeter& meter);

}  // namespace km
