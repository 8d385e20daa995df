#include <catch2/catch.hpp>

#include <random>
#include <sstream>

#include "apps/pgo/closure_input.hpp"
#include "apps/pgo/pcm_report.hpp"
#include "apps/pgo/pcm_run.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "test/modules/outlier_rejection/chain.hpp"
#include "test/modules/outlier_rejection/random_graph.hpp"
#include "test/support/shared_data.hpp"

namespace km {
namespace {

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

TEST_CASE("A run ends with the set that Pcm has", "[pcm]") {
  const CliqueMethod search =
      GENERATE(CliqueMethod::kExact, CliqueMethod::kIncremental, CliqueMethod::kBatch);
  const bool gate = GENERATE(false, true);
  CAPTURE(to_string(search), gate);
  std::mt19937 rng(1);
  std::vector<LabelledClosure> closures = mixed(60, rng);
  PcmConfig config;
  config.search = search;
  config.odometry_gate = gate;
  const PcmRun run = run_pcm(closures, config);
  Pcm pcm(0, 0, config);
  std::size_t known = 0;
  for (const auto& [closure, outlier] : closures)
    known += pcm.add(closure) == PcmVerdict::kRepeated ? 1 : 0;
  REQUIRE(known == 0);
  CHECK(run.additions.size() == pcm.size());
  CHECK(run.additions.back().clique == pcm.inliers().size());
  CHECK(run.additions.size() + run.dropped_true + run.dropped_false == closures.size());
  CHECK((run.dropped_false > 0) == gate);
  // 40 true ones; 1 % of their pairs, about 8, may fail by chance and cost a member each.
  CHECK(run.additions.back().clique >= 32);
  CHECK(run.additions.back().true_members == run.additions.back().clique);
}

TEST_CASE("Closures that cannot be weighed are named", "[pcm]") {
  std::mt19937 rng(1);
  std::vector<LabelledClosure> closures = mixed(3, rng);
  closures[1].closure.covariance(0, 0) = -1.0;
  CHECK_THROWS_WITH(run_pcm(closures, PcmConfig{}), Catch::Contains("cannot be weighed"));
}

TEST_CASE("The JSON of a run has the agreed keys", "[pcm]") {
  PcmRun run;
  run.search = "batch";
  run.additions = {{.vertices = 1,
                    .check_s = 0.5,
                    .search_s = 0.25,
                    .clique = 3,
                    .true_members = 2,
                    .true_vertices = 2,
                    .bound = 4}};
  std::ostringstream one, two;
  write_pcm_json(one, std::vector{run});
  std::string text = one.str();
  std::erase_if(text, [](char c) { return c == ' ' || c == '\n'; });
  CHECK(text ==
        R"({"search":"batch","additions":[{"vertices":1,"check_s":0.5,"search_s":0.25,"clique":3,)"
        R"("true_members":2,"false_members":1}]})");
  run.additions[0].true_members.reset();
  write_pcm_json(two, std::vector{run, run});
  CHECK(two.str().front() == '[');
  CHECK_THAT(two.str(), Catch::Contains("\"false_members\": null"));
}

TEST_CASE("The report of an empty run, and of one vertex, is one", "[pcm]") {
  const auto vertices = GENERATE(std::size_t{0}, std::size_t{1});
  const PcmRun run = run_pcm(ConsistencyRows(vertices), PcmConfig{});
  CHECK_THAT(pcm_text(run), Catch::Contains("a maximum at every step"));
  CHECK_THAT(pcm_plot(std::vector{run}), Catch::StartsWith("<svg"));
}

TEST_CASE("Manhattan with 1000 outliers: true closures make the clique", "[pcm]") {
  const auto file = shared_data("pose_graphs/2d/manhattan.g2o");
  if (!file) return;
  ClosureChoice selection;
  selection.outliers = 1000;
  PcmConfig config;
  config.odometry_gate = true;
  const PcmRun run = run_pcm(read_closures(*file, {}, selection).closures, config);
  // The gate is lenient where odometry has become uncertain, but never drops more than the 1 % of
  // true closures that its confidence gives away.
  CHECK(run.dropped_true <= 20);
  CHECK(run.dropped_false >= 500);
  const PcmAddition& last = run.additions.back();
  CHECK(last.clique == last.bound);
  CHECK(*last.true_members >= 1900);
  CHECK(last.clique - *last.true_members <= 5);
}

}  // namespace
}  // namespace km
