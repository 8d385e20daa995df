#pragma once

#include <vector>

#include "apps/lab/pgo_study/team_solver.hpp"

namespace km {

struct VerificationOptions {
  int max_iterations = 500;
  double tolerance = 1e-3;  ///< Bound of the relative change of the eigenvalue over 10 iterations.
};

/// Outcome of a distributed verification, see CertificateAgent.
struct [[nodiscard]] TeamVerification {
  double lambda_min = 0.0;  ///< Least Rayleigh quotient found outside the kernel.
  bool negative = false;    ///< Proven: the cost decreases along `direction`.
  bool converged = false;   ///< The iteration has converged.
  int rounds = 0;           ///< Exchanges.
  TeamWork work;
  LiftedPoses direction;  ///< 1 x 4n in the numbering of the graph.
};

/// Searches for directions of negative curvature at critical `X`, r x 4n, by the agents of a whole
/// team. It takes one exchange of X and one sum. Each iteration then takes two exchanges: rows of
/// public poses, and a sum. Quotients above -1e-4 of the cost over 3n are neglected, as in
/// certify().
[[nodiscard]] TeamVerification verify_team(const TeamGraph& graph, const LiftedPoses& X,
                                           const VerificationOptions& options,
                                           const TeamMeter& meter);

}  // namespace km
