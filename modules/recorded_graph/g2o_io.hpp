#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/data/odometry.hpp"
#include "modules/core/data/pose_graph.hpp"

namespace km {

/// A pose of a g2o file, in the frame of the file.
struct G2oVertex {
  KeyframeId id;
  SE3 T_world_kf = SE3::Identity();
};

/// The vertical at a pose. In a file with verticals, the frame of the poses has z up.
struct G2oVertical {
  KeyframeId id;
  Vertical vertical;
};

/// Contents of a g2o file, in its order.
struct G2oGraph {
  int dimension = 3;  ///< 3: *_SE3:QUAT. 2: *_SE2, lifted to z = 0, see read_g2o().
  std::vector<G2oVertex> vertices;
  std::vector<RelativePose> edges;
  std::vector<G2oVertical> verticals = {};  ///< At most one per pose.
  std::size_t indefinite_edges =
      0;  ///< Number of edges weighted by diagonal blocks, see read_g2o().
};

/// Keyframe of a vertex key. A gtsam symbol has a character in the top byte and the index below.
/// Characters a to z are robots 0 to 25, and A to Z are robots 26 to 51. A key without a character
/// has the robot in bits 32 to 47 and the index below; plain numbers below 2^32 are thus keyframes
/// of robot 0. nullopt for all other keys.
[[nodiscard]] std::optional<KeyframeId> keyframe_of_key(std::uint64_t key);

/// Key of a keyframe: a gtsam symbol for robots below 52, else robot * 2^32 + index. Its inverse is
/// keyframe_of_key().
[[nodiscard]] std::uint64_t key_of_keyframe(const KeyframeId& id);

/// Reads VERTEX_SE3:QUAT and EDGE_SE3:QUAT, or VERTEX_SE2 and EDGE_SE2 (not both in one file).
///
/// Quaternions are normalised. The covariance of an edge is the inverse of its information matrix,
/// reordered: g2o has [translation; rotation], the tangent here is [rotation; translation]. The
/// rotation error of g2o is the vector part of the quaternion, about half of the rotation vector.
/// Like SE-Sync, this function reads the information as that of the rotation vector. Edges of 2D
/// files have zero variance in z, roll and pitch.
///
/// An information matrix that is not positive definite has no covariance. SE-Sync uses only its
/// diagonal blocks and therefore still has weights for it: 3D kappa = 3 / (2 tr(I_R^-1)), tau = 3 /
/// tr(I_t^-1), 2D kappa = I_33, tau = 2 / tr(I_t^-1) (read_g2o_file() of SE-Sync). If both are
/// positive, the edge gets the covariance without cross terms that has these weights. Its variances
/// are 1 / (2 kappa) (2D: 1 / kappa) and 1 / tau, and it counts as one of `indefinite_edges`.
///
/// FIX lines and comments (#) are skipped.
///
/// Verticals (directions against gravity) are priors EDGE_SE3_PRIOR on a pose. Their offset
/// PARAMS_SE3OFFSET precedes them and is the identity. The inverse of the measured rotation maps z
/// to the vertical `up` in the frame of the pose. The information is (I - up up^T) / sigma^2 on the
/// rotation and zero elsewhere, i.e. on heading and position.
///
/// Throws std::runtime_error "file:line: what" for any other deviation: unknown tags, missing or
/// surplus fields, numbers that are not finite or beyond measurement_limits.hpp, quaternions not of
/// unit length within 1e-3. It also throws for information matrices without positive weights,
/// duplicate vertices, edges from a pose to itself, priors of any other kind, and two priors on one
/// pose. Edges and priors may name vertices that are not in the file, because these vertices belong
/// to another robot.
/// `file` names the source of `text` in errors.
[[nodiscard]] G2oGraph parse_g2o(const std::string& text, const std::string& file);
[[nodiscard]] G2oGraph read_g2o(const std::filesystem::path& file);

/// Writes a 3D graph. read_g2o() returns the same graph up to rounding. Throws
/// std::invalid_argument if the graph is 2D, a covariance is not positive definite, or a vertical
/// is not a unit vector with a positive sigma; std::runtime_error if writing fails.
void write_g2o(std::ostream& out, const G2oGraph& graph);
void write_g2o(const std::filesystem::path& file, const G2oGraph& graph);

}  // namespace km
