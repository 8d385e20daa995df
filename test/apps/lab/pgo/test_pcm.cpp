#include "apps/lab/pgo/pcm_run.hpp"
#include "apps/lab/pgo/scenario.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "test/modules/outlier_rejection/chain.hpp"
#include "test/modules/outlier_rejection/random_graph.hpp"
#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::string kPcmTool = std::string(KM_BIN_DIR) + "/kimera_multi_pgo pcm ";

// A chain of `keyframes` in the plane, and closures (i, j).
std::string chain_g2o(int keyframes, const std::vector<std::pair<int, int>>& closures) {
  std::string text;
  const std::string noise = " 100 0 0 100 0 100\n";
  for (int i = 0; i + 1 < keyframes; ++i)
    text += "EDGE_SE2 " + std::to_string(i) + ' ' + std::to_string(i + 1) + " 1 0 0" + noise;
  for (const auto& [i, j] : closures)
    text += "EDGE_SE2 " + std::to_string(i) + ' ' + std::to_string(j) + ' ' +
            std::to_string(j - i) + " 0 0" + noise;
  return text;
}

TEST_CASE("pcm prints a table and writes JSON") {
  const TemporaryFolder folder;
  const std::string graph =
      folder.write("chain.g2o", chain_g2o(20, {{0, 5}, {2, 9}, {3, 15}})).string();
  const auto result = succeeded(run_command(kPcmTool + graph + " --search exact batch --json " +
                                            (folder.path() / "out.json").string()));
  CHECK_THAT(result.output, Contains("vertices  clique") &&
                                Contains("exact search: 3 consistent") &&
                                Contains("batch search: 3 consistent"));
  CHECK_THAT(folder.read("out.json"), Contains("\"search\": \"batch\""));
}

TEST_CASE("pcm reports the fault of its input") {
  const TemporaryFolder folder;
  (void)folder.write("two.g2o", chain_g2o(5, {{0, 3}, {1, 4}}));
  (void)folder.write("none.g2o", chain_g2o(5, {}));
  (void)folder.write("gap.g2o", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 0 3 1 0 0 1 0 0 1 0 1\n");
  const auto [arguments, message] = GENERATE(table<std::string, std::string>(
      {{"", "FILE is required"},
       {"two.g2o --search best", "best not in {"},
       {"two.g2o --outliers -1", "--outliers"},
       {"two.g2o --json no/out.json", "no"},
       {"two.g2o --closures 3", "has 2 loop closures, 3 were asked for"},
       {"none.g2o", "none.g2o: has no loop closure"},
       {"gap.g2o", "gap.g2o: no odometry"}}));
  const auto result = run_command("cd " + folder.path().string() + " && " + kPcmTool + arguments);
  CAPTURE(arguments, result.output);
  CHECK(is_refused(result));
  CHECK_THAT(result.output, Contains(message));
}

// Closures inside one robot; every third is random.
std::vector<LabelledClosure> mixed(std::size_t count, std::mt19937& rng) {
  const TwoRobots twice(0, 0, 60, 0.01, rng);
  std::uniform_int_distribution<std::size_t> keyframe(0, 59);
  std::vector<LabelledClosure> closures;
  while (closures.size() < count) {
    const std::size_t i = keyframe(rng);
    const std::size_t j = keyframe(rng);
    if (i == j) continue;
    const SE3 T_i_j = twice.T_world_a[i].inverse() * twice.T_world_a[j];
    const bool outlier = closures.size() % 3 == 2;
    const SE3 measured = outlier ? random_pose(rng) : TwoRobots::noisy(T_i_j, 0.02, rng);
    closures.push_back({closure(twice.a.at(i), twice.a.at(j), measured, 4e-4), outlier});
  }
  return closures;
}

TEST_CASE("A run ends with the set of Pcm, or with a clique of a heuristic") {
  const std::string search = GENERATE("exact", "incremental", "batch");
  CAPTURE(search);
  std::mt19937 rng(1);
  const std::vector<LabelledClosure> closures = mixed(60, rng);
  const PcmRun run = run_pcm(closures, search);
  Pcm pcm(0, 0, PcmConfig{});
  for (const auto& [closure, outlier] : closures)
    REQUIRE(pcm.add(closure) != PcmAddResult::kRepeated);
  const std::size_t best = pcm.inliers().size();
  CHECK((search == "exact" ? run.additions.back().clique == best
                           : run.additions.back().clique <= best));
  CHECK(run.additions.size() + run.dropped_true + run.dropped_false == closures.size());
  CHECK(run.dropped_false > 0);  // contradict odometry
  // There are 40 true closures. About 8 of their pairs (1 %) may fail by chance, and each costs one
  // member.
  CHECK(run.additions.back().clique >= 32);
  CHECK(run.additions.back().true_members == run.additions.back().clique);
}

TEST_CASE("The heuristics find cliques that are no larger than the maximum") {
  const auto starts =
      GENERATE(GreedyClique::Starts::kNewVertex, GreedyClique::Starts::kAllVertices);
  const double density = GENERATE(0.3, 0.6, 0.9);
  CAPTURE(starts == GreedyClique::Starts::kNewVertex, density);
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    std::mt19937 rng(seed);
    const Rows rows = random_graph(40, density, rng);
    GreedyClique greedy(starts);
    MaxClique exact(std::uint64_t{1} << 40U);
    for (const auto& row : rows) {
      const std::size_t before = greedy.clique().size();
      greedy.add(row);
      exact.add(row);
      REQUIRE(is_clique(rows, greedy.clique()));
      REQUIRE(greedy.clique().size() >= before);
      REQUIRE(greedy.clique().size() <= exact.clique().size());
      REQUIRE(greedy.bound() >= exact.clique().size());
    }
    CHECK(greedy.clique().size() * 2 >= exact.clique().size());
  }
}

TEST_CASE("Closures without a usable covariance are refused by name") {
  std::mt19937 rng(1);
  std::vector<LabelledClosure> closures = mixed(3, rng);
  closures[1].closure.covariance(0, 0) = -1.0;
  CHECK_THROWS_WITH(run_pcm(closures), Contains("cannot be weighed"));
}

TEST_CASE("With 1000 outliers the clique of Manhattan consists of true closures") {
  const auto file = shared_data("pose_graphs/2d/manhattan.g2o");
  if (!file) return;
  ClosureChoice selection{.outliers = 1000};
  const PcmRun run = run_pcm(read_closures(*file, selection).closures);
  // The test against odometry is lenient if odometry is uncertain, but drops no more than the 1 %
  // of true closures that its confidence allows.
  CHECK(run.dropped_true <= 20);
  CHECK(run.dropped_false >= 500);
  const PcmAddition& last = run.additions.back();
  CHECK(last.clique == last.bound);
  CHECK(last.true_members >= 1900);
  CHECK(last.clique - last.true_members <= 5);
}

TEST_CASE("Closures come from the file, with random ones among them by the seed") {
  const TemporaryFolder folder;
  const auto file = folder.write("chain.g2o", chain_g2o(20, {{0, 5}, {9, 2}, {3, 15}, {4, 16}}));
  const ClosureChoice selection{.outliers = 30, .keep = 2};
  const auto one = read_closures(file, selection).closures;
  const auto same = read_closures(file, selection).closures;
  REQUIRE(one.size() == 32);
  CHECK(std::ranges::count(one, true, &LabelledClosure::outlier) == 30);
  for (std::size_t k = 0; k < one.size(); ++k) {
    CHECK(one[k].closure.id() == same[k].closure.id());
    CHECK(one[k].closure.covariance == one.front().closure.covariance);
    if (!one[k].outlier)
      CHECK(one[k].closure.T_from_to.translation().x() ==
            Approx(one[k].closure.to.T_odom_kf.translation().x() -
                   one[k].closure.from.T_odom_kf.translation().x()));
  }
  CHECK((one[0].outlier || one[1].outlier));
}

TEST_CASE("Random outliers join keyframes that odometry does not, in their box") {
  const bool planar = GENERATE(false, true);
  CAPTURE(planar);
  RandomOutlierModel model{.robot = 7, .keyframes = 6, .planar = planar, .half_side_m = 3.0};
  model.covariance *= 0.5;
  std::mt19937 rng(1);
  const auto outliers = random_outliers(500, model, rng);
  REQUIRE(outliers.size() == 500);
  double farthest = 0.0;
  for (const RelativePose& edge : outliers) {
    CHECK(edge.from.robot == 7);
    CHECK(edge.to.robot == 7);
    CHECK(edge.from.index + 1 < edge.to.index);
    CHECK(edge.to.index < 6);
    CHECK(edge.covariance == model.covariance);
    CHECK((edge.T_from_to.linear().transpose() * edge.T_from_to.linear()).isIdentity(1e-12));
    if (planar) CHECK(edge.T_from_to.matrix().row(2).isApprox(Eigen::RowVector4d(0, 0, 1, 0)));
    farthest = std::max(farthest, edge.T_from_to.translation().cwiseAbs().maxCoeff());
  }
  CHECK(farthest <= 3.0);
  CHECK(farthest > 2.9);  // 500 x 2 coordinates: below it with probability 1e-14
}

TEST_CASE("Two keyframes are too few for an outlier") {
  std::mt19937 rng(1);
  CHECK_THROWS_WITH(random_outliers(1, {.robot = 0, .keyframes = 2}, rng), Contains("2 keyframes"));
}

}  // namespace
}  // namespace km
