#include "modules/tree_newton/vertical_prior.hpp"

#include "modules/core/geometry/lie.hpp"

namespace km {

double vertical_cost(const VerticalPrior& prior, const Eigen::Ref<const Eigen::MatrixXd>& Y) {
  return prior.weight * (Y * prior.up - Eigen::VectorXd::Unit(Y.rows(), 2)).squaredNorm();
}

std::vector<SE3> levelled(std::vector<SE3> poses, std::span<const VerticalPrior> priors) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const VerticalPrior& prior : priors)
    up += prior.weight * (poses[static_cast<std::size_t>(prior.pose)].linear() * prior.up);
  if (up.isZero(0.0)) return poses;
  const SE3 turn = make_pose(rotation_to_z(up), Eigen::Vector3d::Zero());
  for (SE3& pose : poses) pose = turn * pose;
  return poses;
}

Eigen::MatrixXd level(const Eigen::MatrixXd& world, const Eigen::Vector3d& origin) {
  // Each frame is levelled from the previous one, so rounding errors of the orthonormality of Y
  // must not accumulate.
  const Eigen::MatrixXd Y = nearest_stiefel(world.leftCols<3>());
  const Eigen::VectorXd z = Eigen::VectorXd::Unit(Y.rows(), 2);
  const Eigen::VectorXd up = Y.col(2);
  Eigen::MatrixXd turned(Y.rows(), 3);
  constexpr double kUpsideDown = 1e-12;
  if (const double bisected = 1.0 + up.dot(z); bisected > kUpsideDown) {
    // The rotation in the plane of `up` and z that maps `up` to z.
    const Eigen::VectorXd sum = up + z;
    turned = Y - sum * (sum.transpose() * Y) / bisected + 2.0 * z * (up.transpose() * Y);
  } else {
    turned << Y.col(0), -Y.col(1), -Y.col(2);
  }
  Eigen::MatrixXd levelled(Y.rows(), 4);
  levelled << turned, world.col(3) + (world.leftCols<3>() - turned) * origin;
  return levelled;
}

}  // namespace km
