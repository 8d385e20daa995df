#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/lab/pgo/team_graph.hpp"
#include "apps/lab/pgo/team_graph_file.hpp"

namespace km {

/// Numbers of closures by label and decision.
struct ClosureCounts {
  std::size_t true_kept = 0;
  std::size_t true_lost = 0;
  std::size_t false_kept = 0;
  std::size_t false_rejected = 0;

  [[nodiscard]] std::size_t all_true() const { return true_kept + true_lost; }
};

/// Root mean square of the position errors [m] of a team.
struct TeamAte {
  double team_m = 0.0;    ///< All poses under one rigid alignment.
  std::size_t parts = 0;  ///< Connected parts, each aligned separately; 1: one frame.
};

/// Poses of a connected part of a graph, in a frame of their own.
struct SolvedPart {
  std::vector<std::size_t> poses;  ///< [i]: number in the whole graph.
  std::vector<SE3> T_world_kf;
};

/// Counts of closures inside robots and between robots.
struct LabelCounts {
  ClosureCounts inside;   ///< Both ends on one robot.
  ClosureCounts between;  ///< Ends on two robots.
};

/// Comparison of a solution with the ground truth of the data set.
struct TruthScore {
  std::optional<LabelCounts> closures = {};  ///< Only with labels.
  std::optional<TeamAte> ate = {};           ///< Only with true poses.
  /// ATE of the optimum of all edges that are not labelled false, all trusted. Only with labels and
  /// true poses.
  std::optional<TeamAte> optimum_of_true = {};
  bool certified = false;  ///< True if optimum_of_true is certified in every part.
};

/// Parts of the graph that are connected by edges not labelled false. Precondition: labels.
[[nodiscard]] std::vector<ConnectedPart> true_parts(const LabelledTeamGraph& team);

/// The optimum of edges that are all trusted.
struct TrueOptimum {
  std::vector<SolvedPart> parts;
  bool certified = true;  ///< Every part is certified.
};

/// Optimum of the edges that are not labelled false. Precondition: labels.
[[nodiscard]] TrueOptimum optimum_of_true(const LabelledTeamGraph& team);

/// Counts the closures by their labels and by whether they were `kept`, both by edge of the graph.
/// Without labels all are true. Steps of odometry do not count.
[[nodiscard]] LabelCounts count_closures(const TeamGraph& graph, const std::vector<bool>& is_false,
                                         const std::vector<bool>& kept);

/// Compares the poses of `parts` with the true ones. Poses without a true one do not count.
/// Precondition: true poses.
[[nodiscard]] TeamAte ate_of(const LabelledTeamGraph& team, const std::vector<SolvedPart>& parts);

/// Compares a solution of the whole graph with the ground truth of the data set. `kept`: by edge of
/// the graph; empty: all were kept.
[[nodiscard]] TruthScore score(const LabelledTeamGraph& team, const std::vector<SE3>& T_world_kf,
                               std::vector<bool> kept);

}  // namespace km
