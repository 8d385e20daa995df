#pragma once

#include <ctime>
#include <optional>
#include <string>
#include <vector>

#include "modules/pgo_study/certificate.hpp"
#include "modules/pgo_study/member_team.hpp"
#include "modules/pgo_study/team_solver.hpp"
#include "modules/pgo_study/team_verification.hpp"

namespace km {

/// CPU time of the calling thread [s].
[[nodiscard]] inline double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// A method by its name, and what it takes. kMethods has the names.
struct SolverOptions {
  std::string method = "newton";
  Eigen::Index rank = 5;  ///< rbcd, rbcd-asynchronous: of the relaxation.
  TeamRunOptions run = {.max_rounds = 100};
  bool verify = false;            ///< rbcd: the team looks for a way down from its poses.
  double over_relaxation = 1.95;  ///< rbcd, rbcd-asynchronous: at most; 1: as published.
  int max_delay = 0;              ///< rbcd-asynchronous, as loss and seed: see AsynchronousOptions.
  double loss = 0.0;
  unsigned seed = 1;
  bool trust_all = false;        ///< newton: no closure is false.
  double barc = 0.0;             ///< newton: residual of an inlier [sigma]; 0: the team finds it.
  bool reject_odometry = false;  ///< newton: odometry can be false, too.
  bool tell_private = false;     ///< newton: see TreeNewtonOptions.
  TeamShape shape = TeamShape::kAll;  ///< newton, rbcd: who hears whom.

  [[nodiscard]] bool rejects() const { return method == "newton" && !trust_all; }
  /// The method in the words of the command line.
  [[nodiscard]] std::string name() const { return method + (trust_all ? " --trust-all" : ""); }
};

inline const std::vector<std::string> kMethods = {
    "local", "dgs", "rbcd", "rbcd-asynchronous", "centralized", "newton"};

/// Which edges a method has kept, and how it came to that.
struct Decision {
  std::vector<bool> kept;     ///< Of the graph's edges.
  double noise_scale = 1.0;   ///< Noise of closures, in multiples of what the graph says.
  double threshold = 0.0;     ///< Residual of an inlier [sigma of the graph].
  std::size_t most_sent = 0;  ///< By one robot [B], and received.
  std::size_t most_received = 0;
  bool decided = false;  ///< Else the rounds did not suffice, or the team could not go on.
};

struct SolverRun {
  std::vector<TeamRound> rounds;  ///< [0]: the start. Costs are of all edges, unweighted.
  LiftedPoses X;
  std::optional<TeamVerification> verification;  ///< By the team, if asked for.
  std::optional<Decision> decision;              ///< Of newton.
};

/// Solves `graph` from `start`; newton without one begins at odometry. Throws
/// std::invalid_argument if method, options and graph do not go together.
[[nodiscard]] SolverRun run_solver(const TeamGraph& graph, const std::vector<SE3>& start,
                                   const SolverOptions& options, const TeamMeter& meter);

/// The least cost of a graph all of whose edges are trusted, as one computer finds it.
struct CentralOptimum {
  LiftedPoses X;
  double cost = 0.0;
  bool certified = false;
};

/// By CentralSolver from `start`, and from the chordal initialisation.
[[nodiscard]] CentralOptimum central_optimum(const TeamGraph& graph, const std::vector<SE3>& start);
[[nodiscard]] CentralOptimum central_optimum(const TeamGraph& graph);

/// Measures CPU time of the calling thread.
[[nodiscard]] TeamMeter cpu_meter();

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
