#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "apps/lab/pgo/certificate.hpp"
#include "modules/robust/tree_newton.hpp"

namespace km {

/// Global minimum of a whole pose graph by the Riemannian staircase (Rosen et al., "SE-Sync", IJRR
/// 2019). At one rank it minimises by truncated Newton, preconditioned by a factorisation of Q, and
/// certifies the result. If that fails, it leaves along the negative direction and continues one
/// rank higher. It starts at the rank of the given poses. If the relaxation is exact, rank 3 is
/// enough and cheapest, because the certificate does not depend on the rank. Not thread-safe.
class Staircase {
 public:
  /// Throws std::invalid_argument if `edges` or `verticals` are not usable, see QuadraticProblem.
  Staircase(std::vector<BlockEdge> edges, LiftedPoses start,
            std::vector<VerticalPrior> verticals = {});

  /// Does one Newton step or one verification. False: nothing was left to do.
  bool step();

  /// Continues from `X`, a minimum that another method has found, of the same rank as before. It is
  /// certified first.
  void restart_at_minimum(LiftedPoses X);

  [[nodiscard]] const LiftedPoses& X() const { return X_; }
  [[nodiscard]] double cost() const { return problem_.cost(X_); }
  /// Cost of other poses of the same rank.
  [[nodiscard]] double cost(const LiftedPoses& X) const { return problem_.cost(X); }
  /// Certificate of the current poses; nullopt while Newton steps are due.
  [[nodiscard]] const std::optional<Certificate>& certificate() const { return certificate_; }

 private:
  [[nodiscard]] bool resume();
  void climb();
  void restart();

  QuadraticProblem problem_;
  LiftedPoses X_;
  int iterations_ = 0;  // Newton steps at this rank
  double radius_ = 0.0;
  double gradient_ = 0.0;
  double initial_gradient_ = 0.0;
  double last_decrease_ = 1.0;  // relative decrease of the cost in the last step
  double sufficient_decrease_ = 0.0;
  std::optional<Certificate> certificate_;
};

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
