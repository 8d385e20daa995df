#include "modules/rbcd/rounding.hpp"

#include "modules/core/lie.hpp"

namespace km {

std::vector<SE3> round_to_poses(const LiftedPoses& X, const Eigen::MatrixXd& anchor) {
  const Eigen::Matrix<double, 3, Eigen::Dynamic> Yt = anchor.leftCols<3>().transpose();
  std::vector<SE3> poses;
  poses.reserve(static_cast<std::size_t>(pose_count(X)));
  for (Eigen::Index i = 0; i < pose_count(X); ++i)
    poses.push_back(make_pose(nearest_rotation(Yt * X.middleCols<3>(4 * i)),
                              Yt * (X.col(4 * i + 3) - anchor.col(3))));
  return poses;
}

}  // namespace km
