#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/odometry.hpp"
#include "modules/core/pose_graph.hpp"

namespace km {

/// A pose of a g2o file: its estimate there, in the frame of the file.
struct G2oVertex {
  KeyframeId id;
  SE3 T_world_kf = SE3::Identity();
};

/// Which way is up at a pose, where the frame of the file has z up.
struct G2oVertical {
  KeyframeId id;
  Vertical vertical;
};

/// Contents of a g2o file, in its order.
struct G2oGraph {
  int dimension = 3;  ///< 3: *_SE3:QUAT. 2: *_SE2, lifted to z = 0, see read_g2o().
  std::vector<G2oVertex> vertices;
  std::vector<RelativePose> edges;
  std::vector<G2oVertical> verticals = {};  ///< At most one of a pose.
  std::size_t indefinite_edges = 0;  ///< Weighed by the blocks of their information, read_g2o().
};

/// Keyframe of a vertex key. A gtsam symbol (letter in the top byte, index below) belongs to robot
/// 0 to 25 for a to z, 26 to 51 for A to Z; a plain number below 2^32 is a keyframe of robot 0;
/// otherwise the robot stands in bits 32 to 47. nullopt for keys that are none of these.
[[nodiscard]] std::optional<KeyframeId> keyframe_of_key(std::uint64_t key);

/// Key of a keyframe: a gtsam symbol for robots below 52, else robot * 2^32 + index. Its inverse is
/// keyframe_of_key().
[[nodiscard]] std::uint64_t key_of_keyframe(const KeyframeId& id);

/// Reads VERTEX_SE3:QUAT and EDGE_SE3:QUAT, or VERTEX_SE2 and EDGE_SE2 (not both in one file).
///
/// Quaternions are normalised. The covariance of an edge is the inverse of its information matrix,
/// reordered: g2o has [translation; rotation], the tangent here is [rotation; translation]. (g2o's
/// rotation error is the vector part of the quaternion, whose information SE-Sync and others take
/// as that of the angle; so do we.) Edges of 2D files have zero variance in z, roll and pitch.
///
/// An information matrix that is not positive definite has no covariance, but SE-Sync, which looks
/// at its diagonal blocks alone, still has weights for it: 3D kappa = 3 / (2 tr(I_R^-1)), tau = 3 /
/// tr(I_t^-1), 2D kappa = I_33, tau = 2 / tr(I_t^-1) (read_g2o_file() of SE-Sync). If both are
/// positive the edge gets the covariance with no cross terms that has these weights, variances
/// 1 / (2 kappa) (2D: 1 / kappa) and 1 / tau, and counts as one of `indefinite_edges`.
///
/// FIX lines and comments (#) are skipped.
///
/// Verticals are priors EDGE_SE3_PRIOR on a pose, with an offset PARAMS_SE3OFFSET that stands
/// before them and is the identity: the inverse of the measured rotation carries z to `up`, and the
/// information is (I - up up^T) / sigma^2 on the rotation and zero on everything else, i.e. on
/// heading and place.
///
/// Throws std::runtime_error "file:line: what" for any other deviation: unknown tags, missing or
/// surplus fields, numbers that are not finite, quaternions not of unit length within 1e-3,
/// information matrices without positive weights, numbers beyond measurement_limits.hpp, vertices
/// given twice, edges from a pose to itself, priors of any other kind, two on one pose. Edges and
/// priors may name vertices that the file does not have (those of another robot).
[[nodiscard]] G2oGraph read_g2o(std::istream& in, const std::string& file);
[[nodiscard]] G2oGraph read_g2o(const std::filesystem::path& file);

/// Writes a 3D graph so that read_g2o() gives it back to rounding. Throws std::invalid_argument if
/// the graph is 2D, a covariance is not positive definite, or a vertical is not a unit vector with
/// a positive sigma; std::runtime_error if writing fails.
void write_g2o(std::ostream& out, const G2oGraph& graph);
void write_g2o(const std::filesystem::path& file, const G2oGraph& graph);

}  // namespace km
