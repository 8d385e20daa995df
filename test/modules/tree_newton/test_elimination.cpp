#include <sys/resource.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "modules/tree_newton/closure_cover.hpp"
#include "modules/tree_newton/frontal_cholesky.hpp"
#include "modules/tree_newton/sparse_choice.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd random_matrix(std::mt19937& rng, Index rows, Index cols) {
  std::normal_distribution<double> normal;
  MatrixXd M(rows, cols);
  for (double& x : M.reshaped()) x = normal(rng);
  return M;
}

// A chain with random chords, and a definite matrix with its pattern.
struct Problem {
  std::vector<NodePair> pairs;
  std::vector<bool> keep;
  BlockMatrix A;
  MatrixXd dense;
};

Problem random_problem(std::mt19937& rng, int nodes, int chords, Index block, double kept) {
  Problem problem;
  std::set<NodePair> pairs;
  for (int i = 0; i + 1 < nodes; ++i) pairs.insert({i, i + 1});
  std::uniform_int_distribution<int> node(0, nodes - 1);
  for (int k = 0; k < chords; ++k) {
    const int i = node(rng);
    const int j = node(rng);
    if (i != j) pairs.insert({std::min(i, j), std::max(i, j)});
  }
  problem.pairs.assign(pairs.begin(), pairs.end());
  std::shuffle(problem.pairs.begin(), problem.pairs.end(), rng);
  std::bernoulli_distribution keep(kept);
  for (int i = 0; i < nodes; ++i) problem.keep.push_back(keep(rng));
  problem.A = BlockMatrix::zero(block, static_cast<std::size_t>(nodes), problem.pairs.size());
  problem.dense = MatrixXd::Zero(block * nodes, block * nodes);
  for (std::size_t p = 0; p < problem.pairs.size(); ++p) {
    auto& [i, j] = problem.pairs[p];
    if (p % 2 == 1) std::swap(i, j);  // couplings may have either order
    // A sum of squares of two blocks, so that the matrix is definite with the diagonal below.
    const MatrixXd J_i = random_matrix(rng, block, block);
    const MatrixXd J_j = random_matrix(rng, block, block);
    problem.A.at(i) += J_i.transpose() * J_i;
    problem.A.at(j) += J_j.transpose() * J_j;
    problem.A.between(static_cast<int>(p)) += J_i.transpose() * J_j;
    problem.dense.block(block * i, block * j, block, block) += J_i.transpose() * J_j;
    problem.dense.block(block * j, block * i, block, block) += J_j.transpose() * J_i;
  }
  for (int i = 0; i < nodes; ++i) {
    problem.A.at(i) += 0.1 * MatrixXd::Identity(block, block);
    problem.dense.block(block * i, block * i, block, block) = problem.A.at(i);
  }
  return problem;
}

// Scalar rows of the nodes with keep[i] == kept.
std::vector<Index> rows_of(const Problem& problem, bool kept) {
  std::vector<Index> rows;
  const Index block = problem.A.block();
  for (std::size_t i = 0; i < problem.keep.size(); ++i)
    if (problem.keep[i] == kept)
      for (Index r = 0; r < block; ++r) rows.push_back(block * static_cast<Index>(i) + r);
  return rows;
}

MatrixXd dense_schur(const Problem& problem) {
  const auto e = rows_of(problem, false);
  const auto k = rows_of(problem, true);
  const MatrixXd A_ek = problem.dense(e, k);
  return problem.dense(k, k) - A_ek.transpose() * problem.dense(e, e).llt().solve(A_ek);
}

}  // namespace

TEST_CASE("the Schur complement equals that of the dense matrix") {
  const unsigned seed = GENERATE(1U, 2U, 3U, 4U, 5U, 6U);
  const Index block = GENERATE(1, 3, 6);
  CAPTURE(seed, block);
  std::mt19937 rng(seed);
  const Problem problem = random_problem(rng, 40, 25, block, 0.25);
  const auto plan = std::make_shared<const EliminationPlan>(problem.keep, problem.pairs);
  FrontalCholesky factor(plan);
  REQUIRE(factor.factorise(problem.A));
  const MatrixXd expected = dense_schur(problem);
  MatrixXd schur = MatrixXd::Zero(expected.rows(), expected.cols());
  for (std::size_t k = 0; k < plan->kept().size(); ++k)
    schur.block(block * static_cast<Index>(k), block * static_cast<Index>(k), block, block) =
        factor.schur().at(static_cast<int>(k));
  for (std::size_t p = 0; p < plan->kept_pairs().size(); ++p) {
    const auto& [a, b] = plan->kept_pairs()[p];
    REQUIRE(a < b);
    schur.block(block * a, block * b, block, block) = factor.schur().between(static_cast<int>(p));
    schur.block(block * b, block * a, block, block) =
        factor.schur().between(static_cast<int>(p)).transpose();
  }
  CHECK((schur - expected).norm() < 1e-11 * expected.norm());
}

TEST_CASE("the selected inverse equals the blocks of the dense inverse") {
  const unsigned seed = GENERATE(1U, 2U, 3U, 4U);
  const Index block = GENERATE(1, 3, 6);
  const double kept = GENERATE(0.0, 0.2, 1.0);
  CAPTURE(seed, block, kept);
  std::mt19937 rng(seed);
  const Problem problem = random_problem(rng, 60, 40, block, kept);
  const auto plan = std::make_shared<const EliminationPlan>(problem.keep, problem.pairs);
  FrontalCholesky factor(plan);
  REQUIRE(factor.factorise(problem.A));
  const MatrixXd expected = problem.dense.inverse();
  const auto block_of = [&](int i, int j) {
    return expected.block(block * i, block * j, block, block);
  };
  BlockMatrix of_kept = BlockMatrix::zero(block, plan->kept().size(), plan->kept_pairs().size());
  for (std::size_t k = 0; k < plan->kept().size(); ++k)
    of_kept.at(static_cast<int>(k)) = block_of(plan->kept()[k], plan->kept()[k]);
  for (std::size_t p = 0; p < plan->kept_pairs().size(); ++p) {
    const auto& [a, b] = plan->kept_pairs()[p];
    of_kept.between(static_cast<int>(p)) = block_of(plan->kept()[static_cast<std::size_t>(a)],
                                                    plan->kept()[static_cast<std::size_t>(b)]);
  }
  const BlockMatrix inverse = factor.selected_inverse(of_kept);
  double worst = 0.0;
  for (int i = 0; i < plan->nodes(); ++i)
    worst = std::max(worst, (inverse.at(i) - block_of(i, i)).norm());
  for (std::size_t p = 0; p < problem.pairs.size(); ++p) {
    const auto& [i, j] = problem.pairs[p];
    worst = std::max(worst, (inverse.between(static_cast<int>(p)) - block_of(i, j)).norm());
  }
  CHECK(worst < 1e-10 * expected.norm());
}

TEST_CASE("forward and backward solve the dense system") {
  const unsigned seed = GENERATE(1U, 2U, 3U);
  const double kept = GENERATE(0.0, 0.2, 1.0);
  CAPTURE(seed, kept);
  std::mt19937 rng(seed);
  const Problem problem = random_problem(rng, 60, 30, 3, kept);
  FrontalCholesky factor(std::make_shared<const EliminationPlan>(problem.keep, problem.pairs));
  REQUIRE(factor.factorise(problem.A));
  const MatrixXd C = random_matrix(rng, problem.dense.rows(), 2);
  const MatrixXd expected = problem.dense.llt().solve(C);
  MatrixXd X = C;
  factor.forward(X);
  const auto k = rows_of(problem, true);
  if (!k.empty()) {
    const MatrixXd reduced = X(k, Eigen::all);
    const MatrixXd solved = dense_schur(problem).llt().solve(reduced);
    X(k, Eigen::all) = solved;
  }
  factor.backward(X);
  CHECK((X - expected).norm() < 1e-9 * expected.norm());
}

TEST_CASE("factorising an indefinite matrix fails") {
  std::mt19937 rng(1);
  Problem problem = random_problem(rng, 20, 10, 3, 0.2);
  const auto node = std::find(problem.keep.begin(), problem.keep.end(), false);
  problem.A.at(static_cast<int>(node - problem.keep.begin())) -= 1e3 * MatrixXd::Identity(3, 3);
  FrontalCholesky factor(std::make_shared<const EliminationPlan>(problem.keep, problem.pairs));
  CHECK_FALSE(factor.factorise(problem.A));
}

TEST_CASE("a pair outside the graph is refused") {
  CHECK_THROWS_AS(EliminationPlan({false, false}, {{0, 2}}), std::invalid_argument);
  CHECK_THROWS_AS(EliminationPlan({false, false}, {{1, 1}}), std::invalid_argument);
}

TEST_CASE("a cover contains an end of every closure, for any order of closures") {
  const unsigned seed = GENERATE(1U, 2U, 3U, 4U);
  CAPTURE(seed);
  std::mt19937 rng(seed);
  std::uniform_int_distribution<std::uint32_t> index(0, 30);
  std::uniform_int_distribution<int> robot(0, 3);
  std::vector<ClosureId> closures;
  while (closures.size() < 60) {
    const KeyframeId a{static_cast<RobotId>(robot(rng)), index(rng)};
    const KeyframeId b{static_cast<RobotId>(robot(rng)), index(rng)};
    if (a.robot < b.robot) closures.push_back({a, b});
  }
  const std::vector<KeyframeId> cover = cover_closures(closures);
  CHECK(std::is_sorted(cover.begin(), cover.end()));
  const auto covered = [&](const KeyframeId& id) {
    return std::binary_search(cover.begin(), cover.end(), id);
  };
  for (const ClosureId& closure : closures) CHECK((covered(closure.from) || covered(closure.to)));
  // Every pose of the cover is necessary.
  for (const KeyframeId& id : cover)
    CHECK(std::any_of(closures.begin(), closures.end(), [&](const ClosureId& closure) {
      return (closure.from == id && !covered(closure.to)) ||
             (closure.to == id && !covered(closure.from));
    }));
  std::shuffle(closures.begin(), closures.end(), rng);
  CHECK(cover_closures(closures) == cover);
}

TEST_CASE("a pose is kept if eliminating it would couple many others") {
  // Node 0 has six neighbours without couplings: its elimination would replace 6 couplings by 15.
  // Node 7 is between two nodes: its elimination replaces two couplings by one.
  std::vector<NodePair> pairs;
  for (int k = 1; k <= 6; ++k) pairs.push_back({0, k});
  pairs.push_back({1, 7});
  pairs.push_back({2, 7});
  std::vector<bool> keep(8, true);
  keep[0] = keep[7] = false;
  std::vector<bool> expected = keep;
  expected[0] = true;
  CHECK(keep_sparse(keep, pairs) == expected);
}

TEST_CASE("poses that are eliminated first leave the choice among the others as it is") {
  const unsigned seed = GENERATE(range(0U, 20U));
  CAPTURE(seed);
  std::mt19937 rng(seed);
  constexpr int kNodes = 40;
  std::vector<bool> first(kNodes), keep(kNodes);
  for (std::size_t v = 0; v < kNodes; ++v) {
    first[v] = rng() % 2 == 0;
    keep[v] = rng() % 8 == 0;
  }
  std::set<NodePair> pairs;
  std::uniform_int_distribution<int> node(0, kNodes - 1);
  while (pairs.size() < 70) {
    const int i = node(rng), j = node(rng);
    if (i != j) pairs.insert(ordered(i, j));
  }
  std::set<NodePair> left = pairs;
  for (int v = 0; v < kNodes; ++v) {
    if (!first[at(v)] || keep[at(v)]) continue;
    std::set<int> around;
    for (const auto& [i, j] : left)
      if (i == v || j == v) around.insert(i == v ? j : i);
    std::erase_if(left, [v](const NodePair& pair) { return pair[0] == v || pair[1] == v; });
    for (const int i : around)
      for (const int j : around)
        if (i < j) left.insert({i, j});
  }
  const std::vector<bool> expected = keep_sparse(keep, {left.begin(), left.end()});
  CHECK(keep_sparse(keep, {pairs.begin(), pairs.end()}, first) == expected);
}

TEST_CASE("the poses of a day that others do not see take little memory") {
  constexpr std::size_t kPoses = 100'000, kStep = 1000;
  constexpr long kMost_kb = 100'000;  // the square of all poses takes 1.25 GB
  std::vector<bool> keep(kPoses, false), first(kPoses, true);
  keep.front() = keep.back() = true;
  for (std::size_t k = 0; k < kPoses; k += kStep) first[k] = false;
  std::vector<NodePair> chain;
  for (int k = 1; at(k) < kPoses; ++k) chain.push_back({k - 1, k});
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  CHECK(keep_sparse(keep, chain, first) == keep);
  getrusage(RUSAGE_SELF, &after);
  CHECK(after.ru_maxrss - before.ru_maxrss < kMost_kb);
}

}  // namespace km
