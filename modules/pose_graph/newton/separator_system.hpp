#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "modules/pose_graph/newton/frontal_cholesky.hpp"
#include "modules/pose_graph/newton/newton_messages.hpp"

namespace km {

/// Shares of all robots in a round, by robot: sums over them are in that order on every robot.
using NewtonShares = std::map<RobotId, std::shared_ptr<const NewtonShare>>;

/// The sum of all robots' Schur complements onto the poses that they keep, the separators of the
/// team, which every robot assembles and solves for itself. A pose graph says nothing about where
/// it lies in the world, so the unknowns of one separator, the middle one, are given. Not
/// thread-safe.
class SeparatorSystem {
 public:
  struct Solution {
    Eigen::MatrixXd x;       ///< (B separators) x k.
    double decrement = 0.0;  ///< Of the whole system: C^T A^-1 C, summed over its columns.
  };

  /// Takes in the Schur complements of all shares; the first ones bring their pattern. False if the
  /// sum is not positive definite. Throws std::invalid_argument if a share does not fit.
  [[nodiscard]] bool factorise(const NewtonShares& shares);

  /// Solves for the right-hand sides of `shares` with the last factorisation, `given` (B x k) being
  /// the middle separator's unknowns.
  [[nodiscard]] Solution solve(const NewtonShares& shares, const Eigen::MatrixXd& given) const;

  /// The same for a step of an upright team (B = 6, k = 1): vertical priors say how the middle
  /// separator is tilted; its place and its turn about the vertical are held.
  [[nodiscard]] Solution solve_upright(const NewtonShares& shares) const;

  /// All poses that some robot keeps, ascending; empty before the first factorise().
  [[nodiscard]] const std::vector<KeyframeId>& separators() const { return separators_; }

 private:
  struct Member {
    std::vector<int> kept;  // places in separators_
    std::vector<int> pair;  // of each of its couplings, in the plan
    std::vector<bool> transposed;
  };
  void learn_pattern(const NewtonShares& shares);
  [[nodiscard]] Solution reduce(const NewtonShares& shares, Eigen::Index block,
                                Eigen::Index columns) const;
  [[nodiscard]] Eigen::Index middle_row(Eigen::Index block) const;
  void add_kept_edges(const NewtonShare& share, const Member& member, BlockMatrix& sum) const;

  std::vector<KeyframeId> separators_;
  std::map<RobotId, Member> members_;
  std::shared_ptr<const EliminationPlan> plan_;
  std::optional<FrontalCholesky> factor_;
};

}  // namespace km
