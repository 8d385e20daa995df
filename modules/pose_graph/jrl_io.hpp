#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/core/stamp.hpp"
#include "modules/pose_graph/recorded_graph.hpp"

namespace km {

/// A relative pose of a JRL file, with the covariance as it stands there.
struct JrlMeasurement {
  RelativePose edge;
  Stamp stamp = 0;            ///< Of its entry; of the earliest one if it is there several times.
  bool may_be_false = false;  ///< Listed in "potential_outlier_factors".
  bool is_false = false;      ///< Listed in "outlier_factors".
};

/// A team's pose graph with its truth, as JRL (JSON Robot Log) holds it.
struct JrlGraph {
  std::string name;
  std::vector<RobotId> robots;               ///< Ascending.
  std::vector<JrlMeasurement> measurements;  ///< Robot by robot, in the order of the file.
  bool has_labels = false;                   ///< The file has "outlier_factors".
  std::map<KeyframeId, SE3> truth;           ///< T_world_kf; empty if the file has none.
  std::map<KeyframeId, SE3> initial;  ///< T_world_kf of "initialization"; empty if there is none.
  std::map<RobotId, std::vector<Stamp>> stamps;  ///< [i]: when keyframe i became known.
  std::size_t priors = 0;                        ///< Read, checked and not used.
  std::size_t repeated = 0;                      ///< Exact copies that were left out.
};

/// Reads a JRL file of 3D poses (github.com/DanMcGann/jrl, format/*.md), as COSMO-Bench has them.
///
/// Robots are letters or character codes; robot a is 0, see keyframe_of_key(). A map by robot may
/// also be a list of pairs [robot, value], a map by key a list of values with a "key" each. Labels
/// of a file with one robot may be one list. Covariances are those of the tangent [rotation;
/// translation] at the measurement, as RelativePose has them: nothing is exchanged or dropped.
/// Quaternions are normalised. A measurement that several lists hold with equal keys, pose and
/// covariance counts once. Measurements of one pair that differ all count. A robot's list of poses
/// may hold poses of others; the list of the robot itself says more than those.
///
/// PriorFactorPose3 is counted and not used: the frame of a team is its own.
///
/// Throws std::runtime_error "file: /place/in/the/document: what" for everything else: no JSON,
/// missing members, wrong types, numbers beyond measurement_limits.hpp, quaternions not of unit
/// length within 1e-3, covariances that are not symmetric and positive definite, other types of
/// measurements and values, robots that the file does not name, keys that no chain of odometry from
/// index 0 reaches, labels of no measurement, and poses given twice in one list.
[[nodiscard]] JrlGraph read_jrl(const std::filesystem::path& file);

/// The same of the document itself; `file` names it in errors.
[[nodiscard]] JrlGraph parse_jrl(const std::string& text, const std::string& file);

/// What `robot` knows of the graph: its odometry, and the closures that touch it. Throws
/// std::runtime_error "file: what" if the file has no such robot, or it has no odometry.
[[nodiscard]] RecordedGraph part_of(const JrlGraph& graph, RobotId robot, const std::string& file);

}  // namespace km
