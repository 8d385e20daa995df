#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// The part of one robot of a recorded pose graph.
struct RecordedGraph {
  RobotId robot = 0;
  int dimension = 3;                         ///< 2: planar, lifted to z = 0.
  std::vector<RelativePose> odometry;        ///< [i]: from keyframe i to i + 1 of `robot`.
  std::vector<RelativePose> intra_closures;  ///< Between keyframes of `robot`; order of the file.
  std::vector<RelativePose> inter_closures;  ///< One end on `robot`, either one; order of the file.
  std::map<KeyframeIndex, Vertical> verticals = {};  ///< Known verticals of its keyframes.
  std::size_t indefinite_edges = 0;                  ///< See G2oGraph.
  /// [i]: time of keyframe i, strictly ascending. Empty if the file has no times.
  std::vector<Stamp> stamps = {};

  [[nodiscard]] std::size_t poses() const { return odometry.size() + 1; }
  /// Pose of keyframe 0 in `odom`: the identity, or, if keyframe 0 has a vertical, the smallest
  /// rotation after which z points up.
  [[nodiscard]] SE3 T_odom_first() const;
};

/// The graph as robots solve it. In the plane, each edge gets the covariance in space with equal
/// weights, because the file has no variance of roll, pitch and z.
[[nodiscard]] RecordedGraph in_space(RecordedGraph graph);

/// [i]: keyframe i of `graph`, chained along its odometry from T_odom_first(), with the covariance
/// accumulated since keyframe 0.
[[nodiscard]] std::vector<OdometryPose> odometry_poses(const RecordedGraph& graph);

/// Divides the measurements in the file of one robot into odometry and closures. Edges from
/// keyframe i to i + 1 are its odometry (a second one for the same i is a closure). Other edges
/// inside the robot and edges to other robots are closures. A step without an edge is unknown, see
/// kUnknownStep_m. The robot is the one whose own keyframes have edges between them. `file` names
/// the source in errors.
///
/// Throws std::runtime_error "file: what" unless exactly one robot has edges between its own
/// keyframes and every edge ends on it. Also throws if a keyframe from 0 to the last one has
/// no edge.
[[nodiscard]] RecordedGraph make_recorded_graph(const std::vector<RelativePose>& edges,
                                                const std::string& file);

/// Reads measurements as rows robot_src, pose_src, robot_dst, pose_dst, qx, qy, qz, qw, tx, ty, tz,
/// kappa, tau [, ...] below one line of column names. Further columns must be numbers and are not
/// used. kappa and tau weigh rotation and translation, see precision.hpp. Quaternions are
/// normalised. Throws std::runtime_error "file:line: what".
[[nodiscard]] std::vector<RelativePose> parse_measurements(const std::string& text,
                                                           const std::string& file);

/// Reads the part of one robot from a g2o file (*.g2o) with its verticals, or from a table of
/// measurements (*.csv). From the JRL file of a team (*.jrl) it reads the part of `robot`. Throws
/// std::runtime_error as the functions above and read_jrl() do. Also throws "file: what" if a
/// vertical has no keyframe on the chain of the robot, or if the file contains another robot than
/// `robot`. Throws for a JRL file without `robot`.
[[nodiscard]] RecordedGraph read_recorded_graph(const std::filesystem::path& file,
                                                std::optional<RobotId> robot = std::nullopt);

}  // namespace km
