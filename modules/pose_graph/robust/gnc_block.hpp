#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "modules/pose_graph/newton/frontal_cholesky.hpp"
#include "modules/pose_graph/newton/robot_system.hpp"
#include "modules/pose_graph/robust/gnc_messages.hpp"

namespace km {

/// One robot's own poses and edges in a team's GncAgents: weighted, linearised and eliminated onto
/// the poses that others know. Edges to others are not among them; everyone forms those himself
/// (see PublicSystem), so that what this robot has to tell hardly changes with the weights.
/// Not thread-safe.
class GncBlock {
 public:
  /// `edges` of one robot, of which those to others only say which poses are public. Throws
  /// std::invalid_argument as RobotGraph does.
  GncBlock(const RobotEdges& edges, int dimension);

  /// Public poses, ascending; of a robot alone its middle one.
  [[nodiscard]] const std::vector<KeyframeIndex>& public_poses() const { return public_; }
  /// Which of them its other poses couple, in places of public_poses().
  [[nodiscard]] const std::vector<NodePair>& pairs() const { return graph_.plan()->kept_pairs(); }

  /// Multiplies the precisions of the edges by `weights`, one each, from 0 to 1.
  void weigh(std::span<const double> weights);
  /// Some weight is now so different that the last second derivatives mislead.
  [[nodiscard]] bool stale() const;

  /// Weighted cost of its edges.
  [[nodiscard]] double cost(std::span<const SE3> poses) const;
  /// Length of the unweighted residual of an edge [sigma].
  [[nodiscard]] double residual(std::size_t edge, std::span<const SE3> poses) const;

  /// Cost, right-hand side and, with `curvature`, Schur complement at `poses`; without, that of the
  /// last time holds on. Full second derivatives that are indefinite give way to Gauss-Newton's.
  /// Throws std::runtime_error if some poses hang together with no public one.
  [[nodiscard]] GncShare share(std::span<const SE3> poses, std::optional<Curvature> curvature);

  /// Steps of all its poses, B x poses, for those of the public ones, B x public poses, from the
  /// equations of the last share.
  [[nodiscard]] Eigen::MatrixXd substitute_back(
      const Eigen::Ref<const Eigen::MatrixXd>& steps) const;

 private:
  void factorise(std::span<const SE3> poses, Curvature curvature);

  RobotId self_;
  int dimension_;
  RobotGraph graph_;
  std::vector<KeyframeIndex> public_;
  FrontalCholesky factor_;
  std::vector<BlockEdge> edges_;
  std::vector<double> weights_;
  std::vector<double> factor_weights_;  // of the last factorisation
  Eigen::MatrixXd forwarded_;           // of the last share: the eliminated right-hand side
};

}  // namespace km
