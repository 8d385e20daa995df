#pragma once

#include <cstdint>
#include <vector>

#include "modules/core/geometry.hpp"
#include "modules/core/ids.hpp"
#include "modules/pose_graph/newton/block_matrix.hpp"

namespace km {

/// An edge between robots, as the one with the lower id tells it to the team.
struct GncLink {
  KeyframeIndex own = 0;
  KeyframeId other;
  bool odometry = false;  ///< A trusted step from one robot's last pose to another's first.
  bool from_own = true;   ///< The measurement is of `other` in the frame of `own`; else inverse.
  SE3 T_from_to = SE3::Identity();
  double kappa = 1.0;
  double tau = 1.0;
};

/// First message of a robot that takes part in graduated non-convexity: what is public of it.
struct GncHello {
  RobotId robot = 0;
  double barc = 0.0;  ///< As in its GncOptions: everyone decides for himself, so all need one.
  std::vector<GncLink> links = {};  ///< To robots with higher ids; to each in one order for both.
  std::vector<KeyframeIndex> poses = {};  ///< Public poses, ascending.
  std::vector<SE3> T_start_pose = {};     ///< Where they start.
  bool common_frame = false;              ///< The start is in the frame of the team; else its own.
  std::vector<NodePair> pairs = {};       ///< Places in `poses` that its other poses couple, i < j.
  std::uint32_t closures = 0;             ///< Inside the robot.
  /// At the start, of the edges inside that may be rejected: closures, then steps of odometry, if
  /// those may [sigma].
  std::vector<float> residuals = {};
};

/// A round of a robot: its own part of the system, eliminated onto its public poses.
struct GncShare {
  RobotId robot = 0;
  std::uint32_t round = 0;
  double base_cost = 0.0;  ///< Of its own edges, present weights, where the last step began.
  double cost = 0.0;       ///< The same after the step, where all that follows belongs.
  double decrement = 0.0;  ///< Squared norm of the forward-substituted eliminated right-hand side.
  Eigen::Index block = 0;  ///< Unknowns per pose, B.
  Eigen::VectorXd reduced = {};       ///< B per public pose: right-hand side.
  BlockMatrix schur = {};             ///< Pattern as in its GncHello; empty: as told before.
  std::vector<float> residuals = {};  ///< As in its GncHello.
};

}  // namespace km
