#include <algorithm>
#include <catch2/catch.hpp>
#include <set>
#include <sstream>
#include <string>

#include "apps/lab/pgo/outlier_study.hpp"
#include "test/support/command.hpp"
#include "test/support/page_text.hpp"
#include "test/support/team_graphs.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

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

TEST_CASE("outliers compares methods in a table, JSON and a plot", "[outliers]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("laps.g2o", laps_g2o()).string();
  const CommandResult result = run_command(
      kOutliersTool + graph + " --robots 2 --shares 12.5,25 --seeds 1,2 --outlier-range 20 " +
      "--json " + (folder.path() / "out.json").string() + " --plot " +
      (folder.path() / "out.html").string());
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output,
             Contains("20 poses, 16 true closures, 2 robots") && Contains("which is certified") &&
                 Contains("pcm+newton    25 %      4") && Contains("pcm+newton  12.5 %      2"));
  const std::string json = folder.read("out.json");
  for (const char* key : {"poses", "robots", "true_closures", "certified", "half_side_m", "method",
                          "share_percent", "noise_scale", "seed", "false_closures", "true_kept",
                          "false_kept", "rmse_m", "rounds", "decided", "bytes", "cpu_s"})
    CHECK_THAT(json, Contains(std::string("\"") + key + "\":"));
  CHECK_THAT(json, Contains("\"share_percent\": 12.5"));
  const Json plots = data_of_page(folder.read("out.html"), "plots")["charts"];
  REQUIRE(plots.size() == 4);
  for (const Json& plot : plots) {
    REQUIRE(plot["series"].size() == 3);
    CHECK(plot["series"][2]["name"] == "pcm+newton");
    CHECK(plot["series"][2]["style"] == "marked");
    CHECK(plot["series"][2]["points"].size() == 2);
    CHECK(plot["series"][2]["points"][1][0] == 25);
  }
}

TEST_CASE("Clusters of false closures are added on request", "[outliers]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("laps.g2o", laps_g2o()).string();
  const CommandResult result =
      run_command(kOutliersTool + graph + " --robots 2 --shares 0 --methods newton --clusters 2:3");
  CAPTURE(result.output);
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.output, Contains("newton    0 %      6"));
}

TEST_CASE("outliers shows the worst result of several seeds", "[outliers]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("laps.g2o", laps_g2o()).string();
  const auto rmse_of = [&](const std::string& seeds) {
    const CommandResult result = run_command(
        kOutliersTool + graph + " --robots 2 --shares 25 --methods none --seeds " + seeds);
    CAPTURE(result.output);
    REQUIRE(result.exit_code == 0);
    std::istringstream row(result.output.substr(result.output.find("none")));
    std::string method, percent;
    double share = 0.0, wrong = 0.0, true_kept = 0.0, false_kept = 0.0, rmse_m = 0.0;
    row >> method >> share >> percent >> wrong >> true_kept >> false_kept >> rmse_m;
    REQUIRE(row);
    return rmse_m;
  };
  const double worst_m = std::max({rmse_of("1"), rmse_of("2"), rmse_of("3")});
  CHECK(worst_m > 0.1);
  CHECK(rmse_of("1,2,3") == worst_m);
}

TEST_CASE("outliers reports the fault of its input", "[outliers]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("laps.g2o", laps_g2o()).string();
  const auto fails_with = [](const std::string& arguments, const std::string& message) {
    const CommandResult result = run_command(kOutliersTool + arguments);
    CAPTURE(arguments, result.output);
    CHECK(result.exit_code == 1);
    CHECK_THAT(result.output, Contains(message));
  };
  fails_with("", "FILE is required");
  fails_with(graph + " --methods best", "best not in");
  fails_with(graph + " --shares -5", "--shares");
  fails_with(graph + " --pcm-sigmas 0", "--pcm-sigmas");
  fails_with(graph + " --robots 30", "20 poses, which cannot be divided among 30 robots");
  fails_with(graph + " --json /nowhere/out.json", "there is no folder /nowhere");
  fails_with(folder.write("steps.g2o", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n").string() + " --robots 1",
             "no loop closure");
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

TEST_CASE("false closures follow a graph's own edges and depend on the seed alone", "[outliers]") {
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

TEST_CASE("pairwise consistency keeps true closures and no false ones", "[outliers]") {
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

TEST_CASE("pairwise consistency multiplies all sigmas by the given scale", "[outliers]") {
  TeamGraph modest = clean_graph(1);
  constexpr double kScale = 0.004;  // the graph claims 250 times the actual noise
  for (BlockEdge& e : modest.edges) {
    e.kappa *= kScale * kScale;
    e.tau *= kScale * kScale;
  }
  const auto kept = pairwise_consistent(corrupt(clean_graph(1), 40, 30.0, 1), {});
  const TeamGraph corrupted = corrupt(modest, 40, 30.0, 1);
  CHECK(pairwise_consistent(corrupted, {}, kScale) == kept);
  CHECK(pairwise_consistent(corrupted, {}) != kept);
}

TEST_CASE("pairwise consistency refuses a robot with interrupted odometry", "[outliers]") {
  TeamGraph graph = clean_graph(1);
  std::erase_if(graph.edges, [](const BlockEdge& e) { return e.i == 4 && e.j == 5; });
  CHECK_THROWS_WITH(pairwise_consistent(graph, {}), Catch::Contains("0:5"));
}

TEST_CASE("rejected closures do not distort the map, and kept false ones do", "[outliers]") {
  const OutlierStudyOptions options{
      .shares_percent = {0.0, 30.0}, .methods = kRejections, .barc = 6.0};
  std::vector<std::size_t> remaining;
  const OutlierStudy study = run_outlier_study(
      clean_graph(5), options, {},
      [&](std::size_t done, std::size_t all) { remaining.push_back(all - done); });
  CHECK(study.certified);
  CHECK(study.half_side_m > 1.0);
  REQUIRE(study.results.size() == 8);
  CHECK(remaining.size() == 9);
  CHECK(remaining.back() == 0);
  for (const OutlierResult& result : study.results) {
    CAPTURE(result.method, result.share_percent);
    CHECK(result.true_kept <= study.true_closures);
    if (result.share_percent == 0.0) CHECK(result.false_closures == 0);
    if (result.method == "none") {
      CHECK(result.true_kept == study.true_closures);
      CHECK(result.false_kept == result.false_closures);
      CHECK((result.rmse_m < 1e-4) == (result.share_percent == 0.0));
    } else {
      CHECK(result.decided);
      CHECK(result.false_kept == 0);
      CHECK(result.rmse_m < kSigma);  // lost true closures change poses by less than their noise
    }
    if (result.method == "newton") CHECK(result.true_kept == study.true_closures);
  }
}

}  // namespace
}  // namespace km
