#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "modules/pgo_study/connected_parts.hpp"
#include "modules/pgo_study/team_graph_file.hpp"

namespace km {

/// What became of closures whose truth a data set knows.
struct ClosureCounts {
  std::size_t true_kept = 0;
  std::size_t true_lost = 0;
  std::size_t false_kept = 0;
  std::size_t false_rejected = 0;
};

/// Root mean square of the position errors [m] of a team.
struct TeamAte {
  double team_m = 0.0;            ///< All poses under one rigid alignment.
  std::vector<double> in_team_m;  ///< [k]: poses of robot k under that alignment.
  std::vector<double> alone_m;    ///< [k]: poses of robot k under an alignment of their own.
  std::size_t parts = 0;          ///< Connected parts, each aligned by itself; 1: one frame.
};

/// Poses of a connected part of a graph, in a frame of their own.
struct SolvedPart {
  std::vector<std::size_t> poses;  ///< [i]: number in the whole graph.
  std::vector<SE3> T_world_kf;
};

/// Counts of closures by where their ends are.
struct LabelCounts {
  ClosureCounts inside;   ///< Both ends on one robot.
  ClosureCounts between;  ///< Ends on two robots.
};

/// How a solution compares with what the data set says.
struct TruthScore {
  std::optional<LabelCounts> closures = {};  ///< Only with labels.
  std::optional<TeamAte> ate = {};           ///< Only with true poses.
  /// Of the optimum of all edges that are not labelled false, all trusted. Only with both.
  std::optional<TeamAte> optimum_of_true = {};
  bool certified = false;  ///< That optimum is the global one, of every part.
};

/// The parts that the edges not labelled false connect. Precondition: labels.
[[nodiscard]] std::vector<ConnectedPart> true_parts(const LabelledTeamGraph& team);

/// The optimum of edges that are all trusted.
struct TrueOptimum {
  std::vector<SolvedPart> parts;
  bool certified = true;  ///< Of every part.
};

/// That of the edges in `keep_edge` that are not labelled false. Precondition: labels.
[[nodiscard]] TrueOptimum optimum_of_true(const LabelledTeamGraph& team,
                                          const std::vector<bool>& keep_pose,
                                          const std::vector<bool>& keep_edge);

/// Counts the `known` closures by their labels and by whether they were `kept`, both of the graph's
/// edges. Steps of odometry do not count. Precondition: labels.
[[nodiscard]] LabelCounts count_closures(const LabelledTeamGraph& team,
                                         const std::vector<bool>& known,
                                         const std::vector<bool>& kept);

/// Compares the poses of `parts` with the true ones. Poses without a true one do not count.
/// Precondition: true poses.
[[nodiscard]] TeamAte ate_of(const LabelledTeamGraph& team, const std::vector<SolvedPart>& parts);

/// Compares a solution of the whole graph with all that the data set says. `kept`: of the graph's
/// edges; empty: all were kept.
[[nodiscard]] TruthScore score(const LabelledTeamGraph& team, const std::vector<SE3>& T_world_kf,
                               std::vector<bool> kept);

}  // namespace km
