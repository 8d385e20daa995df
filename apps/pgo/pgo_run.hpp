#pragma once

#include <optional>
#include <string>
#include <vector>

#include "modules/pose_graph/certificate.hpp"
#include "modules/pose_graph/team/asynchronous_team.hpp"
#include "modules/pose_graph/team/team_verification.hpp"

namespace km {

enum class SolveMethod {
  kLocal,
  kDgs,
  kRbcd,
  kRbcdAccelerated,
  kRbcdAsynchronous,
  kCentralized,
  kNewton
};

[[nodiscard]] const char* to_string(SolveMethod method);

struct PgoOptions {
  SolveMethod method = SolveMethod::kRbcd;
  Eigen::Index rank = 5;
  TeamRunOptions run = {.max_rounds = 100};
  bool greedy = false;            ///< rbcd only.
  double over_relaxation = 1.95;  ///< rbcd and rbcd-asynchronous only, at most; 1: as published.
  AsynchronousOptions asynchronous = {};  ///< rbcd-asynchronous only.
  bool own_start = false;                 ///< newton only: the team finds the chordal start itself.
  bool verify = false;                    ///< rbcd only: the staircase over the rank.
  std::optional<double> optimum = {};     ///< Computed if not given.
};

/// What one method did to one graph.
struct PgoRun {
  SolveMethod method = SolveMethod::kRbcd;
  double start_s = 0.0;           ///< CPU time of the chordal initialisation.
  std::vector<TeamRound> rounds;  ///< [0]: the start.
  LiftedPoses X;
  std::vector<SE3> T_world_kf;  ///< Rounded, in the frame of the first pose; z up with verticals.
  double rounded_cost = 0.0;
  double optimum = 0.0;     ///< The certified one; the least cost known if none is.
  Certificate certificate;  ///< Central.
  std::optional<TeamVerification> verification;  ///< Distributed, if asked for.
  Eigen::Index rank = 0;  ///< Numerical, of the rotations; 3 (2 in the plane): no relaxation left.
};

/// Solves `graph` from its chordal initialisation, which is computed centrally and not counted,
/// unless the team finds it itself; with verticals, levelled by them as a whole.
/// Throws std::invalid_argument if method and graph do not go together.
[[nodiscard]] PgoRun run_pgo(const TeamGraph& graph, const PgoOptions& options,
                             const TeamMeter& meter);

}  // namespace km
