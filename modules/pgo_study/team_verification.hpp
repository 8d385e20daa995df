#pragma once

#include <vector>

#include "modules/pgo_study/team_solver.hpp"

namespace km {

struct VerificationOptions {
  int max_iterations = 500;
  double tolerance = 1e-3;  ///< Of the eigenvalue: its relative change over 10 iterations.
};

/// Outcome of a distributed verification, see CertificateAgent.
struct [[nodiscard]] TeamVerification {
  double lambda_min = 0.0;  ///< Least Rayleigh quotient found outside the kernel.
  bool negative = false;    ///< Proven: going along `direction` lowers the cost.
  bool converged = false;   ///< If not negative: the iteration has come to its end.
  int rounds = 0;           ///< Exchanges.
  TeamWork work;
  LiftedPoses direction;  ///< 1 x 4n in the numbering of the graph.
};

/// Looks for directions of negative curvature at critical `X`, r x 4n, by the agents of a whole
/// team: one exchange of X and one sum, then two exchanges for each iteration, rows of public poses
/// and a sum. Quotients above -1e-4 of the cost over 3n are no concern, as in certify().
[[nodiscard]] TeamVerification verify_team(const TeamGraph& graph, const LiftedPoses& X,
                                           const VerificationOptions& options,
                                           const TeamMeter& meter);

}  // namespace km
