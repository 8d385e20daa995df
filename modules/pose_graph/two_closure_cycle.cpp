#include "modules/pose_graph/two_closure_cycle.hpp"

namespace km {
namespace {

UncertainPose exact(UncertainPose pose) {
  pose.Sigma.setZero();
  return pose;
}

}  // namespace

Matrix6 TwoClosureCycle::covariance() const {
  return compose(compose(compose(up, above), down), below).Sigma;
}

Matrix6 TwoClosureCycle::covariance_of_odometry() const {
  return TwoClosureCycle{exact(up), above, exact(down), below}.covariance();
}

Matrix6 TwoClosureCycle::covariance_of_closures() const {
  return TwoClosureCycle{up, exact(above), down, exact(below)}.covariance();
}

}  // namespace km
