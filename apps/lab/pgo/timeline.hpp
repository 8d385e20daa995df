#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/lab/pgo/solvers.hpp"
#include "apps/lab/pgo/truth_score.hpp"

namespace km {

/// Solution of the graph that is known at one time, started from odometry.
struct Instant {
  double after_s = 0.0;                    ///< Time since the first pose.
  std::size_t poses = 0;                   ///< Number of poses known at this time.
  std::size_t closures = 0;                ///< Number of closures known at this time.
  std::size_t parts = 0;                   ///< Connected parts, each solved separately.
  int rounds = 0;                          ///< Largest number of rounds of a part.
  double critical_path_s = 0.0;            ///< Largest critical path of a part.
  bool decided = true;                     ///< False: the rounds did not suffice for some part.
  std::optional<LabelCounts> counts = {};  ///< Counts of the known closures; only with labels.
  std::optional<TeamAte> ate = {};         ///< Each part aligned separately; only with true poses.
  std::optional<TeamAte> optimum_of_true =
      {};  ///< See TruthScore; for the graph known at this time.
};

/// Solves the graph known at each of `instants` times, according to the stamps of poses and
/// measurements. The times are spread evenly from the first pose to the last measurement, and the
/// last one has the whole graph. Each solve starts from scratch. Preconditions: the data set has
/// stamps; instants > 0. Throws as solve() does.
[[nodiscard]] std::vector<Instant> play(const LabelledTeamGraph& team, const SolverOptions& options,
                                        std::size_t instants, const TeamMeter& meter);

}  // namespace km
