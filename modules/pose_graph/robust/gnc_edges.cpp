#include "modules/pose_graph/robust/gnc_edges.hpp"

#include <cmath>

namespace km {

double edge_residual(const SE3& T_world_i, const SE3& T_world_j, const SE3& T_i_j, double kappa,
                     double tau) {
  const SE3 predicted = T_world_i * T_i_j;
  return std::sqrt(kappa * (T_world_j.linear() - predicted.linear()).squaredNorm() +
                   tau * (T_world_j.translation() - predicted.translation()).squaredNorm());
}

}  // namespace km
