#include "modules/pose_graph/newton/newton_agent.hpp"

// The chordal initialisation of a NewtonAgent's team.

namespace km {

using Eigen::Index;
using Eigen::MatrixXd;

NewtonShare NewtonAgent::rotation_share() {
  const RobotSystem system = rotation_system(*graph_, dimension_);
  factorise_own(system);
  return share_of(system, true);
}

NewtonShare NewtonAgent::set_rotations() {
  factorise_separators();
  const MatrixXd given = MatrixXd::Identity(dimension_, dimension_);
  const MatrixXd separators = separator_system_.solve(shares_.at(round_), given).x;
  const MatrixXd X = substitute_back(separators);
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    nodes_[k].linear() = rotation_of(X.middleRows(dimension_ * static_cast<Index>(k), dimension_));
  for (std::size_t k = 0; k < separator_poses_.size(); ++k)
    separator_poses_[k].linear() =
        rotation_of(separators.middleRows(dimension_ * public_separators_[k], dimension_));
  const RobotSystem system = translation_system(*graph_, nodes_, dimension_);
  factorise_own(system);
  return share_of(system, true);
}

NewtonShare NewtonAgent::set_translations() {
  factorise_separators();
  const MatrixXd given = MatrixXd::Zero(1, dimension_);
  const MatrixXd separators = separator_system_.solve(shares_.at(round_), given).x;
  const MatrixXd X = substitute_back(separators);
  for (std::size_t k = 0; k < nodes_.size(); ++k)
    nodes_[k].translation().head(dimension_) = X.row(static_cast<Index>(k)).transpose();
  for (std::size_t k = 0; k < separator_poses_.size(); ++k)
    separator_poses_[k].translation().head(dimension_) =
        separators.row(public_separators_[k]).transpose();
  return newton_share(Elimination::kGaussNewton);
}

}  // namespace km
