#pragma once

#include <span>
#include <vector>

#include "modules/pose_graph/block_matrix.hpp"

namespace km {

/// In which order the nodes of a graph are eliminated from a symmetric matrix with the pattern of
/// the graph, and what that fills in: the symbolic part of a multifrontal Cholesky factorisation
/// (Duff, Reid, "The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations", ACM
/// TOMS 1983). Nodes may be kept: then what remains is the Schur complement onto them. The order is
/// that of approximate minimum degree (Amestoy, Davis, Duff, SIAM J. Matrix Anal. Appl. 1996);
/// consecutive nodes with (nearly) equal neighbours are eliminated together, in one dense front.
/// Immutable; made once, used for any block size.
class EliminationPlan {
 public:
  /// A dense matrix over `nodes`, of which the first `pivots` are eliminated.
  struct Front {
    std::vector<int> nodes = {};
    int pivots = 0;
    int parent = -1;  ///< Front that the rest is added to; -1: the kept nodes'.
    std::vector<int> children = {};
    std::vector<int> pairs = {};  ///< Couplings first met here.
  };

  /// `keep` has one entry per node; `pairs` are the couplings, without repetition.
  /// Throws std::invalid_argument if a pair names no two nodes.
  EliminationPlan(std::vector<bool> keep, std::vector<NodePair> pairs);

  [[nodiscard]] int nodes() const { return static_cast<int>(keep_.size()); }
  [[nodiscard]] const std::vector<NodePair>& pairs() const { return pairs_; }
  /// Children before parents.
  [[nodiscard]] std::span<const Front> fronts() const { return fronts_; }
  /// Kept nodes, ascending.
  [[nodiscard]] const std::vector<int>& kept() const { return kept_; }
  /// Couplings of the Schur complement, in places of kept(): the second is the lower one.
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
