#include "modules/outlier_rejection/prepared_closure.hpp"

namespace km {
namespace {

// Added to a closure's variances so that exact cycles can be weighed: 1e-6 rad and 1e-6 m.
constexpr double kLeastVariance = 1e-12;

}  // namespace

PreparedClosure::PreparedClosure(const OrientedClosure& closure)
    : id(closure.id),
      a(closure.a.id),
      b(closure.b.id),
      t_odoma_a(closure.a.T_odom_kf.translation()),
      T_odoma_odomb(closure.a.T_odom_kf * closure.T_a_b.T * closure.b.T_odom_kf.inverse()),
      odometry_a(transported(closure.a.T_odom_kf, BlockCovariance(closure.a.covariance))),
      odometry_b(transported(closure.b.T_odom_kf, BlockCovariance(closure.b.covariance))),
      measured(transported(
          closure.a.T_odom_kf * closure.T_a_b.T,
          BlockCovariance(closure.T_a_b.Sigma + kLeastVariance * Matrix6::Identity()))) {}

}  // namespace km
