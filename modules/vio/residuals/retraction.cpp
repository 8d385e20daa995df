#include "modules/vio/residuals/retraction.hpp"

#include "modules/core/lie.hpp"

namespace km {

SE3 retract(const SE3& T, const Eigen::Ref<const Vector6>& delta) {
  const Eigen::Quaterniond q(T.linear() * so3_exp(delta.head<3>()));
  return make_pose(q.normalized().toRotationMatrix(),
                   T.translation() + T.linear() * delta.tail<3>());
}

Vector6 local_coordinates(const SE3& from, const SE3& to) {
  Vector6 delta;
  delta.head<3>() = so3_log(from.linear().transpose() * to.linear());
  delta.tail<3>() = from.linear().transpose() * (to.translation() - from.translation());
  return delta;
}

}  // namespace km
