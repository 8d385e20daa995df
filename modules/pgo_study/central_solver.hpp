#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "modules/pgo_study/staircase.hpp"
#include "modules/pose_graph/tree_newton.hpp"

namespace km {

/// Global minimum of a whole pose graph on one computer, certified. First Newton's method among
/// rigid poses with exact sparse factorisations (TreeNewton, a team of one): where the relaxation
/// is exact and the start good, its minimum is the relaxation's, and the certificate says so. Where
/// it is not certified the Riemannian staircase goes on from there (Staircase). Not thread-safe.
class CentralSolver {
 public:
  /// `start`: r x 4n, z up if there are verticals; unless it holds rigid poses (r = 3) the
  /// staircase begins with it at once. `dimension` 2: poses and measurements are planar. Throws
  /// std::invalid_argument if `edges` or `verticals` are not usable, see QuadraticProblem.
  CentralSolver(const std::vector<BlockEdge>& edges, LiftedPoses start, int dimension,
                const StaircaseOptions& options = {}, std::vector<VerticalPrior> verticals = {});

  /// One Newton step, or one verification. False: all is done.
  bool step();

  [[nodiscard]] const LiftedPoses& X() const { return newton_ ? X_ : staircase_.X(); }
  /// Of the present poses; nullopt while steps are due.
  [[nodiscard]] const std::optional<Certificate>& certificate() const {
    return staircase_.certificate();
  }
  [[nodiscard]] double cost() const { return staircase_.cost(X()); }

 private:
  Staircase staircase_;
  std::unique_ptr<TreeNewton> newton_;
  LiftedPoses X_;  // Newton's
};

}  // namespace km
