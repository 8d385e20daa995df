#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "apps/lab/pgo/staircase.hpp"
#include "modules/pose_graph/tree_newton.hpp"

namespace km {

/// Certified global minimum of a whole pose graph on one computer. The first method is Newton's
/// among rigid poses with exact sparse factorisations (TreeNewton as a team of one). If the
/// relaxation is exact and the start is good, the minimum of Newton's method is that of the
/// relaxation, and the certificate proves this. Otherwise the Riemannian staircase continues from
/// this minimum (Staircase). Not thread-safe.
class CentralSolver {
 public:
  /// `start`: r x 4n, z up if there are verticals. If it does not hold rigid poses (r = 3), the
  /// staircase begins with it at once. `dimension` 2: poses and measurements are planar. Throws
  /// std::invalid_argument if `edges` or `verticals` are not usable, see QuadraticProblem.
  CentralSolver(const std::vector<BlockEdge>& edges, LiftedPoses start, int dimension,
                std::vector<VerticalPrior> verticals = {});

  /// Does one Newton step or one verification. False: nothing was left to do.
  bool step();

  [[nodiscard]] const LiftedPoses& X() const { return newton_ ? X_ : staircase_.X(); }
  /// Certificate of the current poses; nullopt while steps are due.
  [[nodiscard]] const std::optional<Certificate>& certificate() const {
    return staircase_.certificate();
  }
  [[nodiscard]] double cost() const { return staircase_.cost(X()); }

 private:
  Staircase staircase_;
  std::unique_ptr<TreeNewton> newton_;
  LiftedPoses X_;  // poses of the Newton method
};

}  // namespace km
