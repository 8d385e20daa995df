#pragma once

#include <optional>

#include "apps/lab/pgo/certificate.hpp"
#include "modules/rbcd/truncated_newton.hpp"

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

}  // namespace km
