#include "modules/pose_graph/vertical_prior.hpp"

#include <Eigen/SVD>

#include "modules/pose_graph/stiefel.hpp"

namespace km {

double vertical_cost(const VerticalPrior& prior, const Eigen::Ref<const Eigen::MatrixXd>& Y) {
  return prior.weight * (Y * prior.up - lifting_matrix(Y.rows()).col(2)).squaredNorm();
}

Eigen::MatrixXd level(const Eigen::MatrixXd& world, const Eigen::Vector3d& origin) {
  const Eigen::MatrixXd Y = world.leftCols<3>();
  const Eigen::VectorXd z = lifting_matrix(Y.rows()).col(2);
  // The two horizontal axes nearest to the present ones: the polar factor of what is left of them
  // without z.
  const Eigen::MatrixXd horizontal = Y.leftCols<2>() - z * (z.transpose() * Y.leftCols<2>());
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(horizontal,
                                              Eigen::ComputeThinU | Eigen::ComputeThinV);
  Eigen::MatrixXd levelled(Y.rows(), 4);
  levelled.leftCols<2>() = svd.matrixU() * svd.matrixV().transpose();
  levelled.col(2) = z;
  levelled.col(3) = world.col(3) + (Y - levelled.leftCols<3>()) * origin;
  return levelled;
}

}  // namespace km
