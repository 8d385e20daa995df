#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/core/stamp.hpp"
#include "modules/recorded_graph/recorded_graph.hpp"

namespace km {

/// A relative pose of a JRL file, with its unchanged covariance.
struct JrlMeasurement {
  RelativePose edge;
  Stamp stamp = 0;        ///< Time of the earliest entry with this measurement.
  bool is_false = false;  ///< Listed in "outlier_factors".
};

/// The pose graph of a team with its truth, from a JRL file (JSON Robot Log).
struct JrlGraph {
  std::vector<RobotId> robots;                   ///< Ascending.
  std::vector<JrlMeasurement> measurements;      ///< Robot by robot, in the order of the file.
  bool has_labels = false;                       ///< The file has "outlier_factors".
  std::map<KeyframeId, SE3> truth;               ///< T_world_kf; empty if the file has none.
  std::map<RobotId, std::vector<Stamp>> stamps;  ///< [i]: when keyframe i became known.
  std::size_t priors = 0;    ///< Number of priors that were read, checked and not used.
  std::size_t repeated = 0;  ///< Number of exact copies of measurements, left out.
};

/// Reads a JRL file of 3D poses (github.com/DanMcGann/jrl, format/*.md), as in COSMO-Bench.
///
/// Robots are single characters or character codes; robot a is 0, see keyframe_of_key(). A map by
/// robot may also be a list of pairs [robot, value], and a map by key may be a list of values with
/// a "key" each. The labels of a file with one robot may be one list. Covariances refer to the
/// tangent [rotation; translation] at the measurement, as in RelativePose: no entry is reordered or
/// dropped. Quaternions are normalised. A measurement that several lists contain with equal keys,
/// pose and covariance counts once. Different measurements of one pair all count. The list of poses
/// of a robot may contain poses of other robots; the list of the other robot has precedence.
///
/// PriorFactorPose3 is counted and not used, because a team defines its own frame.
///
/// Throws std::runtime_error "file: /place/in/the/document: what" for everything else: invalid
/// JSON, missing members, wrong types, other types of measurements and values, and robots that the
/// file does not name. It also throws for numbers beyond measurement_limits.hpp, quaternions not of
/// unit length within 1e-3, and covariances that are not symmetric and positive definite. It also
/// throws for keys that no chain of odometry from index 0 reaches, labels without a measurement,
/// and poses that occur twice in one list.
[[nodiscard]] JrlGraph read_jrl(const std::filesystem::path& file);

/// Parses the text of a JRL file; errors name it `file`.
[[nodiscard]] JrlGraph parse_jrl(const std::string& text, const std::string& file);

/// The part of the graph that `robot` knows: its odometry, and the closures with an end on it.
/// Throws std::runtime_error "file: what" if the file has no such robot, or if the robot has no
/// odometry.
[[nodiscard]] RecordedGraph part_of(const JrlGraph& graph, RobotId robot, const std::string& file);

}  // namespace km
