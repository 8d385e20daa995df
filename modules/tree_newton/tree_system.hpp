#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "modules/core/data/single_pose.hpp"
#include "modules/core/ids.hpp"
#include "modules/tree_newton/block_matrix.hpp"
#include "modules/tree_newton/edge_model.hpp"

namespace km {

/// An edge between two poses that are both left to the parent. It is sent as an edge instead of its
/// second derivatives, because an edge takes a seventh of their bytes. Single precision does no
/// harm to soft modes: a rounded edge still has zero cost along rigid motions of all poses.
struct SentEdge {
  int pair = 0;             ///< The coupling of the system to which it adds.
  bool transposed = false;  ///< The edge leads from the second pose of `pair` to the first.
  Curvature curvature = Curvature::kGaussNewton;
  float kappa = 0.0F;  ///< Without its weight.
  float tau = 0.0F;
  float weight = 1.0F;  ///< In [0, 1].
  SinglePose present;   ///< T_i_j at the poses of the equations.
  SinglePose measured;  ///< Measured T_i_j; only sent and used with Curvature::kFull.

  [[nodiscard]] EdgeModel model() const;
};

/// A pose that a robot leaves to those above it in the tree.
struct TreeVariable {
  KeyframeId id;
  std::uint32_t touched = 0;  ///< Number of robots of the subtree that use it.
  std::uint32_t of = 0;       ///< Number of robots of the team that use it; 0: unknown.
};

/// The part of a subtree in the Newton equations, eliminated onto the poses that it leaves to the
/// robots above it.
struct TreeSystem {
  std::vector<TreeVariable> variables = {};
  std::vector<NodePair> pairs = {};  ///< Coupled variables, as places in `variables`.
  BlockMatrix schur = {};            ///< Schur complement without `edges`.
  std::vector<SentEdge> edges = {};
};

/// True if the coupling of this pair, between these two variables, is sent: it does not round to
/// zero.
[[nodiscard]] bool is_sent(const BlockMatrix& schur, const NodePair& ends, int pair);

/// The inverse of the second derivatives of the team at the variables of a TreeSystem, column by
/// column.
struct TreeInverse {
  /// In double precision, with the couplings of all pairs: for covariances of relative poses, which
  /// are small differences.
  bool fine = false;
  std::vector<double> diagonal = {};  ///< Lower triangles of the diagonal blocks.
  /// Couplings as correlations. Unless `fine`, they are those that the system was sent with, in
  /// whole units of 1 / 32767. The error of a covariance is then at most 1.6e-5 of the product of
  /// its standard deviations.
  std::vector<double> correlations = {};

  /// `inverse` has the variables and `pairs` of a system with the Schur complement `schur`.
  /// Couplings that are zero there are not part of the factor, so the child does not need them.
  [[nodiscard]] static TreeInverse of(const BlockMatrix& inverse, std::span<const NodePair> pairs,
                                      const BlockMatrix& schur, bool fine);
  /// nullopt if the sizes differ from those of the system.
  [[nodiscard]] std::optional<BlockMatrix> decoded(std::span<const NodePair> pairs,
                                                   const BlockMatrix& schur) const;
};

/// A new weight of a sent edge, by its place in the edges of the system.
struct NewWeight {
  std::uint32_t edge = 0;
  float weight = 0.0F;
};

/// Couplings are sent as whole numbers of this unit, a share of the geometric mean of the two
/// diagonal entries.
[[nodiscard]] double unit_of_coupling(const BlockMatrix& S, const NodePair& ends, Eigen::Index row,
                                      Eigen::Index column);
[[nodiscard]] std::int64_t in_units(double coupling, double unit);

}  // namespace km
