#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "apps/lab/pgo/team_graph.hpp"
#include "modules/core/geometry/precision.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "modules/recorded_graph/jrl_io.hpp"

namespace km {

/// Weights of a relative pose in a graph of this dimension. 3: precision_of(), as robots weigh
/// their measurements. 2: planar_precision_of(). Throws std::invalid_argument if `covariance` (in
/// the plane, for dimension 2) is not positive definite.
[[nodiscard]] Precision precision_of_blocks(const Matrix6& covariance, int dimension);

/// Divides the poses of a graph among `robots` robots, in ascending order of ids. Each robot gets a
/// contiguous block of equal length, and the last robot also gets the rest. `file` names the source
/// in errors.
///
/// Vertices may come in any order. Estimates in the file are not used. Parallel edges all count. A
/// file without any vertices takes them from its edges. Throws std::runtime_error "file: what" if
/// there are too few poses, a vertex of an edge or prior is missing, a weight is not usable, or the
/// graph is not connected.
[[nodiscard]] TeamGraph partition_contiguously(const G2oGraph& graph, std::size_t robots,
                                               const std::string& file);

/// Divides the poses of a graph by a given map, which has the robot of every pose and of no other.
/// Robots are 0 to N - 1, and each has a pose. Otherwise as partition_contiguously().
[[nodiscard]] TeamGraph partition_graph(const G2oGraph& graph,
                                        const std::map<KeyframeId, std::size_t>& robot_of,
                                        const std::string& file);

/// Reads the result of a team's run in `folder`: pose_graph.g2o in the run folder of every robot.
/// If there are none, it reads one file per robot, *.csv or *.g2o (see read_recorded_graph()).
/// fullGraph.g2o is left out, because it repeats all edges. Robots are numbered by ascending id.
/// The number of edges between two poses of two robots is that in the file of the robot from which
/// they start. If that file has none, it is the number in the file of the other robot. Throws
/// std::runtime_error as partition_graph() does, and if the file of a robot is missing.
[[nodiscard]] TeamGraph read_team_folder(const std::filesystem::path& folder);

/// Ground truth of a data set on a team's graph, hidden from solvers. A member is empty if the data
/// set lacks it.
struct TeamTruth {
  std::vector<std::optional<SE3>> T_world_kf = {};  ///< By pose of the graph; nullopt if unknown.
  std::vector<bool> is_false = {};                  ///< By edge of the graph: false closures.
};

struct LabelledTeamGraph {
  TeamGraph graph;
  TeamTruth truth = {};
  std::size_t priors = 0;  ///< Number of priors, see JrlGraph; also `repeated`.
  std::size_t repeated = 0;
};

/// The team of a JRL file. Robot k is the k-th robot of the file. Edges are in the order of the
/// measurements and have the weights of robots. `file` names the source in errors.
/// Throws std::runtime_error as partition_graph() does.
[[nodiscard]] LabelledTeamGraph labelled_team(const JrlGraph& graph, const std::string& file);

}  // namespace km
