#pragma once

#include <ctime>
#include <optional>
#include <string>
#include <vector>

#include "apps/lab/pgo/certificate.hpp"
#include "apps/lab/pgo/round_meter.hpp"
#include "apps/lab/pgo/team_graph.hpp"

namespace km {

/// CPU time of the calling thread [s].
[[nodiscard]] inline double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// A method, by its name in kMethods, and its parameters.
struct SolverOptions {
  std::string method = "newton";
  int max_rounds = 100;
  double over_relaxation = 1.95;  ///< rbcd: largest value; 1: as published.
  bool trust_all = false;         ///< newton: all closures are treated as true.

  [[nodiscard]] bool rejects() const { return method == "newton" && !trust_all; }
  /// The method as given on the command line.
  [[nodiscard]] std::string name() const { return method + (trust_all ? " --trust-all" : ""); }
};

inline const std::vector<std::string> kMethods = {"local", "rbcd", "centralized", "newton"};

/// The edges that a method has kept, and the estimates behind this decision.
struct Decision {
  std::vector<bool> kept;  ///< By edge of the graph.
  /// By robot: the robot whose odometry frame is its world. Robots that are not joined differ.
  std::vector<RobotId> world_of = {};
  double noise_scale = 1.0;   ///< Noise of closures, as a multiple of the graph's.
  double threshold = 0.0;     ///< Largest residual of an inlier [sigma of the graph].
  std::size_t most_sent = 0;  ///< Most bytes that one robot sent; below: received.
  std::size_t most_received = 0;
  bool decided = false;  ///< False: the rounds did not suffice, or the team failed.
};

struct SolverRun {
  /// [0]: the start, with costs of all edges at weight 1. A method that rejects closures reports
  /// only the last round, with the cost of the closures that it keeps.
  std::vector<TeamRound> rounds;
  std::vector<SE3> poses;            ///< In any frame; z up with verticals.
  std::optional<Decision> decision;  ///< Only of newton.
};

/// Solves `graph` from `start`. newton starts from measurements alone unless it trusts all
/// closures. Throws std::invalid_argument if method, options and graph do not fit together.
[[nodiscard]] SolverRun run_solver(const TeamGraph& graph, const std::vector<SE3>& start,
                                   const SolverOptions& options, const TeamMeter& meter);

/// The least known cost of a graph with all edges trusted, computed on one computer.
struct CentralOptimum {
  std::vector<SE3> poses;  ///< In the frame of the first one.
  double cost = 0.0;
  Certificate certificate;
};

/// Computed by solve_alone(), from `start` or from the chordal initialisation.
[[nodiscard]] CentralOptimum central_optimum(const TeamGraph& graph, const std::vector<SE3>& start);
[[nodiscard]] CentralOptimum central_optimum(const TeamGraph& graph);

/// Returns a meter of the CPU time of the calling thread.
[[nodiscard]] TeamMeter cpu_meter();

/// Comparison of poses with the optimum, by one computer that has the whole graph.
struct OptimumComparison {
  double rounded_cost = 0.0;
  double optimum = 0.0;            ///< The least known cost.
  bool optimum_certified = false;  ///< Proven to be the least of all.
  Certificate certificate = {};
};

/// Result of one method on one graph.
struct Solution {
  std::string method;    ///< SolverOptions::name().
  double start_s = 0.0;  ///< CPU time of the chordal initialisation.
  SolverRun run = {};
  /// Poses in the frame of the first one; z up with verticals.
  std::vector<SE3> T_world_kf = {};
  /// nullopt if the method rejects closures: its optimum depends on its own decision.
  std::optional<OptimumComparison> comparison = {};
};

/// Runs a method. A method that rejects closures starts from odometry. Other methods start from the
/// chordal initialisation. It is computed centrally; its time is Solution::start_s, and SolverRun
/// does not count its bytes. With verticals, the initialisation is levelled as a whole. Throws as
/// run_solver() does.
[[nodiscard]] Solution solve(const TeamGraph& graph, const SolverOptions& options,
                             const TeamMeter& meter);

}  // namespace km
