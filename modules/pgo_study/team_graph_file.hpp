#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "modules/core/precision.hpp"
#include "modules/pgo_study/team_graph.hpp"
#include "modules/pose_graph/g2o_io.hpp"
#include "modules/pose_graph/jrl_io.hpp"

namespace km {

/// Weights of a relative pose as SE-Sync reads them from a g2o file: kappa and tau from the
/// information matrix's blocks on the diagonal, cross terms dropped before they are inverted (which
/// precision_of() does after). Dimension 2 takes kappa = I_33, tau = 2 / tr(I_t^-1); 3 takes kappa
/// = 3 / (2 tr(I_R^-1)), tau = 3 / tr(I_t^-1). `covariance` is that of read_g2o(). Throws
/// std::invalid_argument if it is not positive definite (in the plane, for dimension 2).
[[nodiscard]] Precision precision_of_blocks(const Matrix6& covariance, int dimension);

/// Who says what an edge weighs.
enum class EdgeWeights {
  kAsSeSync,   ///< precision_of_blocks(): of public graphs, to compare with published costs.
  kAsTheTeam,  ///< precision_of(): as robots weigh what they measure.
};

/// Deals the poses of a graph out to robots in ascending order of their ids: `robots` runs of equal
/// length, the last one with the rest. `file` names the source in errors.
///
/// Rules: vertices may come in any order; estimates in the file are not used; parallel edges all
/// count. Throws std::runtime_error "file: what" if there are fewer poses than robots, an edge
/// or a prior names a vertex that the file lacks (a file without any vertices takes them from its
/// edges), a weight is not usable, or the graph is not connected.
[[nodiscard]] TeamGraph deal_contiguously(const G2oGraph& graph, std::size_t robots,
                                          const std::string& file);

/// The same with the robot of every pose given, and of no others; robots are 0 to N - 1, none
/// without a pose.
[[nodiscard]] TeamGraph deal(const G2oGraph& graph,
                             const std::map<KeyframeId, std::size_t>& robot_of,
                             const std::string& file, EdgeWeights weights = EdgeWeights::kAsSeSync);

/// Reads rows "vertex robot" for deal(). Throws std::runtime_error "file:line: what".
[[nodiscard]] std::map<KeyframeId, std::size_t> read_partition(const std::filesystem::path& file);

/// Reads what a team's run has left in `folder` (pose_graph.g2o of every robot, in folders of their
/// own; edges weigh what they weighed in the run), or else one file per robot there, *.csv or
/// *.g2o, see read_recorded_graph() (fullGraph.g2o, a copy of all, is left out; kAsSeSync). Robots
/// are numbered by ascending id. An edge between two robots counts as often as the file of the
/// robot it starts from has it; if that has none between the two poses, as often as the other
/// robot's file has. Throws std::runtime_error as deal() does, and if a robot's file is not there.
[[nodiscard]] TeamGraph read_team_folder(const std::filesystem::path& folder);

/// What a data set says of a team's graph that no solver may know. Empty where it says nothing.
struct TeamTruth {
  std::vector<std::optional<SE3>> T_world_kf = {};  ///< Of the graph's poses, where known.
  std::vector<bool> is_false = {};                  ///< Of the graph's edges: false closures.
  std::vector<Stamp> pose_stamps = {};              ///< When each pose became known.
  std::vector<Stamp> edge_stamps = {};              ///< When each edge became known.
};

struct LabelledTeamGraph {
  TeamGraph graph;
  TeamTruth truth = {};
  std::size_t priors = 0;  ///< See JrlGraph, as `repeated`.
  std::size_t repeated = 0;
};

/// The team of a JRL file: robot k is the k-th of its robots, edges are in the order of its
/// measurements and weigh as on the robots (kAsTheTeam). `file` names the source in errors. Throws
/// std::runtime_error as deal() does.
[[nodiscard]] LabelledTeamGraph labelled_team(const JrlGraph& graph, const std::string& file);

}  // namespace km
