#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "modules/pose_graph/newton/block_matrix.hpp"
#include "modules/pose_graph/quadratic_problem.hpp"
#include "modules/pose_graph/robust/gnc_messages.hpp"
#include "modules/pose_graph/robust/gnc_schedule.hpp"

namespace km {

using GncHellos = std::map<RobotId, GncHello>;

/// What all robots of a team know alike: its public poses, numbered robot by robot, and the edges
/// between robots. Immutable.
class PublicGraph {
 public:
  struct Link : BlockEdge {
    RobotId a = 0;  ///< Lower than b.
    RobotId b = 0;
    bool odometry = false;
  };

  /// Throws std::invalid_argument if a link names a pose that its robot does not list, a robot that
  /// is not there, or has a measurement that cannot be used.
  explicit PublicGraph(const GncHellos& hellos);

  [[nodiscard]] int nodes() const { return nodes_; }
  /// In the order of the hellos: robot by robot.
  [[nodiscard]] const std::vector<Link>& links() const { return links_; }
  /// Node of a robot's first public pose.
  [[nodiscard]] int first(RobotId robot) const { return first_.at(robot); }
  /// Robots, ascending, with the number of their public poses.
  [[nodiscard]] const std::map<RobotId, int>& sizes() const { return sizes_; }
  /// Pairs of nodes that a robot's own poses couple.
  [[nodiscard]] const std::vector<NodePair>& pairs(RobotId robot) const { return pairs_.at(robot); }
  /// Which link the k-th edge between two robots is, in the order that both have them in.
  [[nodiscard]] std::size_t link(RobotId a, RobotId b, std::size_t k) const;
  [[nodiscard]] std::size_t link_count(RobotId a, RobotId b) const;

  /// Lengths of the residuals of all links at `poses` of the nodes [sigma].
  [[nodiscard]] std::vector<double> residuals(std::span<const SE3> poses) const;

 private:
  [[nodiscard]] Eigen::Index node(const GncHellos& hellos, const KeyframeId& id) const;

  int nodes_ = 0;
  std::map<RobotId, int> first_;
  std::map<RobotId, int> sizes_;
  std::map<RobotId, std::vector<NodePair>> pairs_;
  std::vector<Link> links_;
  std::map<std::pair<RobotId, RobotId>, std::vector<std::size_t>> links_between_;
};

/// The frames of all robots' starts, as T_world_start. Frames in common are kept; else the robots
/// are placed one by one, the one with most links to those placed next, by trusted odometry if it
/// joins them, or by the vote of the closures (see align_frames()). Throws std::invalid_argument if
/// no link leads to some robot.
[[nodiscard]] std::map<RobotId, SE3> align_starts(const GncHellos& hellos,
                                                  const PublicGraph& graph);

}  // namespace km
