#pragma once

#include <span>
#include <vector>

#include "modules/tree_newton/block_matrix.hpp"

namespace km {

/// The symbolic part of a multifrontal Cholesky factorisation (Duff, Reid, "The Multifrontal
/// Solution of Indefinite Sparse Symmetric Linear Equations", ACM TOMS 1983): the order in which
/// the nodes of a graph are eliminated from a symmetric matrix with its pattern, and the fill-in.
/// Nodes may be kept: the Schur complement onto them then remains. The order is that of approximate
/// minimum degree (Amestoy, Davis, Duff, SIAM J. Matrix Anal. Appl. 1996). Consecutive nodes with
/// (nearly) equal neighbours are eliminated together, in one dense front. Immutable; one plan
/// serves all block sizes.
class EliminationPlan {
 public:
  /// A dense matrix over `nodes`. The first `pivots` nodes are eliminated.
  struct Front {
    std::vector<int> nodes = {};
    int pivots = 0;
    int parent = -1;  ///< Front to which its Schur complement is added; -1: the kept nodes.
    std::vector<int> children = {};
    std::vector<int> pairs = {};  ///< Couplings whose first eliminated node is in this front.
  };

  /// `keep` has one entry per node; `pairs` are the couplings, without repetition. Throws
  /// std::invalid_argument if a pair does not name two different nodes.
  EliminationPlan(std::vector<bool> keep, std::vector<NodePair> pairs);

  [[nodiscard]] int nodes() const { return static_cast<int>(keep_.size()); }
  [[nodiscard]] const std::vector<NodePair>& pairs() const { return pairs_; }
  /// Children before parents.
  [[nodiscard]] std::span<const Front> fronts() const { return fronts_; }
  /// Kept nodes, ascending.
  [[nodiscard]] const std::vector<int>& kept() const { return kept_; }
  /// Couplings of the Schur complement, as places in kept(), the smaller place first.
  [[nodiscard]] const std::vector<NodePair>& kept_pairs() const { return kept_pairs_; }
  /// Place of each node in kept(), -1 for the others.
  [[nodiscard]] const std::vector<int>& place_of_kept() const { return place_of_kept_; }

 private:
  void order_and_fill();
  void find_kept_pairs();

  std::vector<bool> keep_;
  std::vector<NodePair> pairs_;
  std::vector<Front> fronts_;
  std::vector<int> kept_;
  std::vector<int> place_of_kept_;
  std::vector<NodePair> kept_pairs_;
};

}  // namespace km
