#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/pgo/solvers.hpp"
#include "apps/pgo/truth_score.hpp"

namespace km {

/// The graph as far as it is known at one time, solved from odometry.
struct Instant {
  double after_s = 0.0;                    ///< Since the first pose.
  std::size_t poses = 0;                   ///< Known by then.
  std::size_t closures = 0;                ///< Known by then.
  std::size_t parts = 0;                   ///< Connected parts, each solved by itself.
  int rounds = 0;                          ///< Of the part that took the most.
  double critical_path_s = 0.0;            ///< Of the part that took the longest.
  bool decided = true;                     ///< False: the rounds did not suffice for some part.
  std::optional<LabelCounts> counts = {};  ///< Of the known closures; only with labels.
  std::optional<TeamAte> ate = {};         ///< Each part aligned by itself; only with true poses.
  std::optional<TeamAte> optimum_of_true = {};  ///< See TruthScore; of what is known by then.
};

/// Solves what the stamps of poses and measurements say is known at `instants` times, spread evenly
/// from the first pose to the last measurement, the last of them with the whole graph. Each solve
/// starts anew. Preconditions: the data set has stamps; instants > 0. Throws as solve() does.
[[nodiscard]] std::vector<Instant> play(const LabelledTeamGraph& team, const SolverOptions& options,
                                        std::size_t instants, const TeamMeter& meter);

}  // namespace km
