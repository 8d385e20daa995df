#pragma once

#include <cstddef>
#include <filesystem>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"
#include "modules/core/stamp.hpp"

namespace km {

/// One robot's part of a recorded pose graph.
struct RecordedGraph {
  RobotId robot = 0;
  std::vector<RelativePose> odometry;        ///< [i]: from keyframe i to i + 1 of `robot`.
  std::vector<RelativePose> intra_closures;  ///< Between keyframes of `robot`, as in the file.
  std::vector<RelativePose> inter_closures;  ///< `robot` at one end, either one; as in the file.
  std::map<KeyframeIndex, Vertical> verticals = {};  ///< Of its keyframes, where known.
  std::size_t indefinite_edges = 0;                  ///< See G2oGraph.
  /// [i]: time of keyframe i, strictly ascending. Empty if the file has no times.
  std::vector<Stamp> stamps = {};

  [[nodiscard]] std::size_t poses() const { return odometry.size() + 1; }
  /// Where odometry starts: the identity, turned the least that gives its frame z up if keyframe 0
  /// has a vertical.
  [[nodiscard]] SE3 T_odom_first() const;
};

/// The keyframes of `graph` along its odometry from T_odom_first(), [i] being keyframe i, with the
/// covariance accumulated since keyframe 0.
[[nodiscard]] std::vector<OdometryPose> odometry_poses(const RecordedGraph& graph);

/// Sorts the measurements of one robot's file: edges from keyframe i to i + 1 are its odometry (a
/// second one for the same i is a closure), other edges inside the robot and edges to others are
/// closures. The robot is the one that has edges inside itself. `file` names the source in errors.
///
/// Throws std::runtime_error "file: what" unless exactly one robot has edges inside itself, every
/// edge touches it, its odometry is a chain from keyframe 0 without gaps, and its closures end on
/// that chain.
[[nodiscard]] RecordedGraph make_recorded_graph(const std::vector<RelativePose>& edges,
                                                const std::string& file);

/// Reads measurements as rows robot_src, pose_src, robot_dst, pose_dst, qx, qy, qz, qw, tx, ty, tz,
/// kappa, tau [, ...] below one line of column names; further columns are not used, but numbers.
/// kappa and tau weigh rotation and translation, see precision.hpp. Quaternions are normalised.
/// Throws std::runtime_error "file:line: what".
[[nodiscard]] std::vector<RelativePose> read_measurements_csv(std::istream& in,
                                                              const std::string& file);

/// Reads one robot's part from a 3D g2o file (*.g2o), with its verticals, from a table of
/// measurements (*.csv), or that of `robot` from a team's JRL file (*.jrl). Throws
/// std::runtime_error as the functions above and read_jrl() do, and "file: what" if a vertical is
/// not of a keyframe on the robot's chain, if the file holds another robot than `robot`, or if a
/// JRL file is read without `robot`.
[[nodiscard]] RecordedGraph read_recorded_graph(const std::filesystem::path& file,
                                                std::optional<RobotId> robot = std::nullopt);

}  // namespace km
