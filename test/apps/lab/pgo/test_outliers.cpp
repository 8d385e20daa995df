#include <nlohmann/json.hpp>

#include "apps/lab/pgo/agent_team.hpp"
#include "apps/lab/pgo/outlier_study.hpp"
#include "apps/lab/pgo/team_graph_file.hpp"
#include "modules/core/geometry/lie.hpp"
#include "modules/core/io/json.hpp"
#include "test/support/command.hpp"
#include "test/support/random_pose.hpp"
#include "test/support/team_graphs.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::string kOutliersTool = KM_BIN_DIR "/kimera_multi_pgo outliers ";

// A square driven five times in the plane, each lap joined to the one before by closures.
std::string laps_g2o() {
  std::string text;
  const auto edge = [&](int i, int j, const char* measured) {
    text += "EDGE_SE2 " + std::to_string(i) + ' ' + std::to_string(j) + ' ' + measured +
            " 400 0 0 400 0 900\n";
  };
  for (int i = 0; i < 19; ++i) edge(i, i + 1, "1.002 0.001 1.571");
  for (int i = 0; i < 16; ++i) edge(i, i + 4, "0.001 -0.002 0.0005");
  return text;
}

TEST_CASE("outliers compares methods in a table and JSON") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("laps.g2o", laps_g2o()).string();
  const CommandResult result = succeeded(
      run_command(kOutliersTool + graph + " --robots 2 --shares 12.5,25 --seeds 1,2 --json " +
                  (folder.path() / "out.json").string()));
  CHECK_THAT(result.output, Contains("20 poses, 2 robots") && Contains("which is certified") &&
                                Contains("robots    25 %  4 / 4") &&
                                Contains("robots  12.5 %  2 / 2"));
  const Json json = Json::parse(folder.read("out.json"));
  REQUIRE(json["results"].size() == 8);
  for (const char* key : {"method", "share_percent", "seed", "true_closures", "true_lost",
                          "between_robots_lost", "false_closures", "false_kept", "frames", "max_m",
                          "rms_m", "ratio", "rounds", "decided", "bytes", "cpu_s"})
    CHECK(json["results"][0].contains(key));
}

TEST_CASE("outliers runs a scenario with the given share and robots") {
  const TemporaryFolder folder;
  std::ostringstream text;
  for (int i = 0; i < 39; ++i)
    text
        << "EDGE_SE3:QUAT " << i << ' ' << i + 1
        << " 1 0 0 0 0 0.0871557 0.9961947 400 0 0 0 0 0 400 0 0 0 0 400 0 0 0 900 0 0 900 0 900\n";
  for (int i = 0; i < 30; ++i)
    text
        << "EDGE_SE3:QUAT " << i << ' ' << i + 10
        << " 5.6712818 9.8229523 0 0 0 0.7660444 0.6427876 400 0 0 0 0 0 400 0 0 0 0 400 0 0 0 900 "
           "0 0 900 0 900\n";
  const std::string graph = folder.write("laps.g2o", text.str()).string();
  const CommandResult result = succeeded(run_command(
      kOutliersTool + graph + " --scenario three-folders --robots 3 --seeds 4 " +
      "--shares 10 --methods trust-all,reference --json " + (folder.path() / "out.json").string()));
  CHECK_THAT(result.output, Contains("three-folders: 40 poses, 3 robots"));
  const Json json = Json::parse(folder.read("out.json"));
  CHECK(json["results"][0]["false_closures"] == 83);
  CHECK(json["results"][1]["ratio"] == 1.0);
}

TEST_CASE("outliers reports the fault of its input") {
  const TemporaryFolder folder;
  (void)folder.write("laps.g2o", laps_g2o());
  (void)folder.write("step.g2o", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n");
  const auto [arguments, message] = GENERATE(table<std::string, std::string>(
      {{"", "FILE is required"},
       {"laps.g2o --methods best", "best not in"},
       {"laps.g2o --shares -5", "--shares"},
       {"laps.g2o --scenario rain", "rain not in"},
       {"laps.g2o --robots 30", "20 poses, which cannot be divided among 30 robots"},
       {"laps.g2o --json /nowhere/out.json", "there is no folder /nowhere"},
       {"step.g2o --robots 2", "--keep-steps"},
       {"step.g2o --robots 1", "no loop closure"}}));
  const CommandResult result =
      run_command("cd " + folder.path().string() + " && " + kOutliersTool + arguments);
  CAPTURE(arguments, result.output);
  CHECK(is_refused(result));
  CHECK_THAT(result.output, Contains(message));
}

constexpr double kSigma = 0.01;

// A graph of 90 poses whose weights agree with its noise.
TeamGraph clean_graph(unsigned seed) {
  std::mt19937 rng(seed);
  TeamGraph graph = noisy_chain(90, 3, kSigma, rng);
  for (BlockEdge& e : graph.edges) {
    e.kappa = 0.5 / (kSigma * kSigma);
    e.tau = 1.0 / (kSigma * kSigma);
  }
  return graph;
}

TEST_CASE("false closures follow a graph's own edges and depend on the seed alone") {
  TeamGraph graph = clean_graph(1);
  graph.edges[1].kappa = 7.0;
  const TeamGraph corrupted = corrupt(graph, 50, 4.0, 3);
  REQUIRE(corrupted.edges.size() == graph.edges.size() + 50);
  const TeamGraph again = corrupt(graph, 50, 4.0, 3);
  std::set<double> kappas;
  for (std::size_t k = 0; k < corrupted.edges.size(); ++k) {
    const BlockEdge& e = corrupted.edges[k];
    CHECK(e.T_i_j.matrix() == again.edges[k].T_i_j.matrix());
    if (k < graph.edges.size()) continue;
    CHECK(std::abs(e.i - e.j) > 1);
    CHECK(e.T_i_j.translation().cwiseAbs().maxCoeff() <= 4.0);
    kappas.insert(e.kappa);
  }
  CHECK(kappas.contains(0.5 / (kSigma * kSigma)));
  CHECK(corrupt(graph, 1, 4.0, 4).edges.back().T_i_j.matrix() !=
        corrupted.edges[graph.edges.size()].T_i_j.matrix());
  std::erase_if(graph.edges, [](const BlockEdge& e) { return e.j != e.i + 1; });
  CHECK_THROWS_AS(corrupt(graph, 1, 4.0, 3), std::invalid_argument);
}

TEST_CASE("pairwise consistency keeps true closures and no false ones") {
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  const std::size_t own_edges = clean_graph(seed).edges.size();
  const TeamGraph corrupted = corrupt(clean_graph(seed), 40, 30.0, seed);
  const std::vector<bool> kept = pairwise_consistent(corrupted, {});
  std::size_t true_lost = 0, false_kept = 0;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (k >= own_edges && kept[k]) ++false_kept;
    if (k < own_edges && !kept[k]) ++true_lost;
  }
  CHECK(false_kept == 0);
  CHECK(true_lost < own_edges / 4);  // a pair of true ones passes with a probability of 99 %
}

// Few closures, most of which stand alone, and odometry that claims 1.3 rad after 500 steps.
TEST_CASE("a robot with few closures and imprecise odometry keeps its true ones") {
  const auto graph = recorded_team("pose_graphs/2d/input_MITb_g2o.g2o", 1);
  if (!graph) return;
  const OutlierStudy study = run_outlier_study(
      *graph, {.shares_percent = {0.0, 30.0}, .methods = {"robots"}, .seeds = {1, 2, 3}}, {});
  for (const OutlierResult& result : study.results) {
    CAPTURE(result.seed, result.share_percent);
    CHECK(result.true_lost == 0);
    CHECK(result.false_kept <= 1);  // odometry allows it
  }
}

// Most closures inside a robot are false then. Noise of odometry that makes them true lets others
// bend the stretches of up to 56 poses without closures. Recorded closures have no labels.
TEST_CASE("random closures do not pass for noise of odometry") {
  const auto graph = recorded_team("multi_robot/tunnels_8robots", 0);
  if (!graph) return;
  const OutlierStudy study = run_outlier_study(
      *graph, {.shares_percent = {10.0}, .methods = {"robots"}, .seeds = {1}}, {});
  CHECK(study.results.front().false_kept == 0);
}

// Noise is a seventh of what these graphs claim. False closures then move parts of the map that few
// others hold, and have no residual there.
TEST_CASE("false closures within the claimed noise are rejected if the true noise is smaller") {
  const std::string name = GENERATE("intel", "input_M3500_g2o");
  const std::size_t robots = GENERATE(1U, 3U);
  CAPTURE(name, robots);
  const auto graph = recorded_team("pose_graphs/2d/" + name + ".g2o", robots);
  if (!graph) return;
  const OutlierStudy study = run_outlier_study(
      *graph, {.shares_percent = {30.0}, .methods = {"robots"}, .seeds = {1}}, {});
  const OutlierResult& result = study.results.front();
  CHECK(result.false_kept == 0);
  CHECK(100 * result.true_lost <= result.true_closures);
}

// Two robots drive side by side for 300 m. They see each other on the first 200 m and once at the
// end, where drift is 100 to 600 sigma of a closure. All false closures are random.
TEST_CASE("a closure that alone corrects a long drift is kept among false ones") {
  const unsigned seed = GENERATE(range(1U, 6U));
  CAPTURE(seed);
  constexpr Eigen::Index kPoses = 300;
  std::mt19937 rng(seed);
  const auto noise = [&rng](double sigma_rad, double sigma_m) {
    Vector6 xi = random_vector<6>(rng);
    xi.head<3>() *= sigma_rad;
    xi.tail<3>() *= sigma_m;
    return se3_exp(xi);
  };
  TeamGraph graph{.first = {0, kPoses, 2 * kPoses}};
  const SE3 ahead = make_pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d::UnitX());
  for (Eigen::Index i = 0; i < 2 * kPoses; ++i) {
    graph.ids.push_back({0, static_cast<std::uint32_t>(i)});
    if (i + 1 != kPoses && i + 1 != 2 * kPoses)
      graph.edges.push_back({i, i + 1, ahead * noise(0.005, 0.05), 2e4, 400.0});
  }
  const auto add_closure = [&](Eigen::Index i, Eigen::Index j, const SE3& T) {
    graph.edges.push_back({i, kPoses + j, T, 1250.0, 2500.0});
  };
  for (Eigen::Index i = 0; i < 200; ++i) add_closure(i, i, noise(0.02, 0.02));
  add_closure(kPoses - 1, kPoses - 1, noise(0.02, 0.02));
  const std::size_t all_true = graph.edges.size();
  std::uniform_int_distribution<Eigen::Index> pose(0, kPoses - 1);
  for (int n = 0; n < 80; ++n) {
    const Eigen::Index i = pose(rng), j = pose(rng);
    add_closure(i, j, random_pose(rng, 100.0));
  }
  const std::vector<bool> kept = run_agent_team(graph, {}).kept;
  const auto first_false = kept.begin() + static_cast<std::ptrdiff_t>(all_true);
  CHECK(std::count(kept.begin(), first_false, false) == 0);
  CHECK(std::count(first_false, kept.end(), true) == 0);
}

TEST_CASE("noise of steps and closures that no claim covers rejects nothing") {
  const std::size_t robots = GENERATE(1U, 5U);
  CAPTURE(robots);
  const auto graph = recorded_team("pose_graphs/3d/sphere_bignoise_vertex3.g2o", robots);
  if (!graph) return;
  CHECK(std::ranges::count(run_agent_team(*graph, {}).kept, false) == 0);
}

TEST_CASE("rejected closures do not distort the map, and kept false ones do") {
  std::vector<std::size_t> remaining;
  std::vector<std::string> methods = kRejections;
  std::erase(methods, "robots");  // robots use one of several closures between two poses
  const OutlierStudy study = run_outlier_study(
      clean_graph(5), {.shares_percent = {0.0, 30.0}, .methods = methods}, {},
      [&](std::size_t done, std::size_t all) { remaining.push_back(all - done); });
  CHECK(study.certified);
  REQUIRE(study.results.size() == 2 * methods.size());
  CHECK(remaining.size() == study.results.size() + 1);
  CHECK(remaining.back() == 0);
  for (const OutlierResult& result : study.results) {
    CAPTURE(result.method, result.share_percent);
    CHECK(result.decided);
    CHECK((result.false_closures == 0) == (result.share_percent == 0.0));
    if (result.method == "trust-all") {
      CHECK(result.true_lost == 0);
      CHECK(result.false_kept == result.false_closures);
      CHECK((result.rms_m < 1e-4) == (result.share_percent == 0.0));
    } else {
      CHECK(result.false_kept == 0);
      CHECK(result.rms_m < kSigma);  // lost true closures change poses by less than their noise
    }
    if (result.method == "reference") CHECK(result.rms_m < 1e-4);
  }
}

}  // namespace
}  // namespace km
