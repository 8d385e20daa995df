#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/core/data/stamped_pose.hpp"
#include "modules/core/geometry/geometry.hpp"

namespace km {

/// Published poses of one robot with their covariances, and its truth. All outlive the call.
struct ConsistencyInput {
  std::string name;
  std::span<const StampedPose> truth;
  std::span<const StampedPose> estimate;
  std::span<const Matrix6> covariances;  ///< By pose of the estimate, see core/data/covariance.hpp.
};

/// The normalised estimation error squared (NEES; Bar-Shalom, Li, Kirubarajan, "Estimation with
/// Applications to Tracking and Navigation", 2001, Sec. 5.4), e^T Sigma^-1 e divided by its degrees
/// of freedom. It is 1 on average if covariances are right, and larger if they are too small.
struct Consistency {
  std::string name;
  std::size_t poses = 0;         ///< Number of poses compared.
  double pose = 0.0;             ///< Mean NEES of the pose, 6 degrees of freedom.
  double rotation = 0.0;         ///< Mean NEES of the rotation, 3 degrees of freedom.
  double translation = 0.0;      ///< Mean NEES of the translation, 3 degrees of freedom.
  double median = 0.0;           ///< Median NEES of the pose over the median of chi-squared.
  double share_within_95 = 0.0;  ///< Share of poses whose error lies in their 95 % region.
};

/// Compares the errors of all robots with their covariances. The frame of the team is placed in the
/// truth by its origin: the pose with the smallest covariance. If `upright`, both frames have z up,
/// and only the position and the heading of the origin are used. Two kinds of poses do not count:
/// the origin, and poses whose covariance has a trace below a millionth of the largest one. Returns
/// one result per input, and one for all together as the last.
///
/// Throws std::invalid_argument with the name of the input if it shares no pose with its truth, or
/// if the truth has no pose at the origin.
[[nodiscard]] std::vector<Consistency> consistency(std::span<const ConsistencyInput> inputs,
                                                   bool upright);

/// Compares measured relative poses with their covariances. Edges without a true pose at both ends
/// do not count.
[[nodiscard]] Consistency consistency_of_edges(const std::string& name,
                                               std::span<const RelativePose> edges,
                                               const std::map<KeyframeId, SE3>& truth);

}  // namespace km
