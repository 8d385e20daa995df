#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <sstream>
#include <string>

#include "apps/lab/pgo/pcm_report.hpp"
#include "apps/lab/pgo/pcm_run.hpp"
#include "modules/outlier_rejection/pcm.hpp"
#include "test/modules/outlier_rejection/chain.hpp"
#include "test/modules/outlier_rejection/random_graph.hpp"
#include "test/support/command.hpp"
#include "test/support/page_text.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

const std::string kPcmTool = std::string(KM_BIN_DIR) + "/kimera_multi_pgo pcm ";

// A triangle and an isolated vertex.
constexpr const char* kGraph = "4\n\n0\n\n0 1\n";

TEST_CASE("pcm prints a table and writes JSON and a plot", "[pcm]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("graph.txt", kGraph).string();
  const auto result = run_command(kPcmTool + graph + " --search exact batch --json " +
                                  (folder.path() / "out.json").string() + " --plot " +
                                  (folder.path() / "out.html").string());
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output, Contains("vertices  clique") &&
                                Contains("exact search: 3 consistent") &&
                                Contains("batch search: 3 consistent"));
  CHECK_THAT(folder.read("out.json"), Contains("\"search\": \"batch\""));
  const Json plots = data_of_page(folder.read("out.html"), "plots")["charts"];
  REQUIRE(plots.size() == 2);
  CHECK(plots[0]["log_y"] == true);
  REQUIRE(plots[1]["series"].size() == 2);
  CHECK(plots[1]["series"][0]["name"] == "exact");
  CHECK(plots[1]["series"][1]["points"].back() == Json::parse("[4.0, 3.0]"));
}

TEST_CASE("pcm reports the fault of its input", "[pcm]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("graph.txt", kGraph).string();
  const std::string bad = folder.write("bad.txt", "2\n\n7\n").string();
  const std::string other = folder.write("graph.csv", kGraph).string();
  const auto fails_with = [](const std::string& arguments, const std::string& message) {
    const auto result = run_command(kPcmTool + arguments);
    CAPTURE(arguments, result.output);
    CHECK(result.exit_code == 1);
    CHECK_THAT(result.output, Contains(message));
  };
  fails_with("", "FILE is required");
  fails_with("missing.g2o", "missing.g2o");
  fails_with(graph + " --search best", "best not in {");
  fails_with(graph + " --confidence 2", "--confidence");
  fails_with(graph + " --outliers -1", "--outliers");
  fails_with(bad, "bad.txt:3: neighbour 7");
  fails_with(other, "neither .g2o nor .txt");
  fails_with(graph + " --outliers 10", "--outliers needs a pose graph");
  fails_with(graph + " --confidence 0.9", "--confidence needs a pose graph");
  fails_with(graph + " --json " + (folder.path() / "no/out.json").string(), "cannot be written");
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

TEST_CASE("A run ends with the same set as Pcm", "[pcm]") {
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
    known += pcm.add(closure) == PcmAddResult::kRepeated ? 1 : 0;
  REQUIRE(known == 0);
  CHECK(run.additions.size() == pcm.size());
  CHECK(run.additions.back().clique == pcm.inliers().size());
  CHECK(run.additions.size() + run.dropped_true + run.dropped_false == closures.size());
  CHECK((run.dropped_false > 0) == gate);
  // There are 40 true closures. About 8 of their pairs (1 %) may fail by chance, and each costs one
  // member.
  CHECK(run.additions.back().clique >= 32);
  CHECK(run.additions.back().true_members == run.additions.back().clique);
}

TEST_CASE("Closures without a usable covariance are refused by name", "[pcm]") {
  std::mt19937 rng(1);
  std::vector<LabelledClosure> closures = mixed(3, rng);
  closures[1].closure.covariance(0, 0) = -1.0;
  CHECK_THROWS_WITH(run_pcm(closures, PcmConfig{}), Catch::Contains("cannot be weighed"));
}

TEST_CASE("The JSON of a run has the documented keys", "[pcm]") {
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

TEST_CASE("Reports of an empty run and of a run of one vertex are valid", "[pcm]") {
  const auto vertices = GENERATE(std::size_t{0}, std::size_t{1});
  const PcmRun run = run_pcm(ConsistencyRows(vertices), PcmConfig{});
  CHECK_THAT(pcm_text(run), Catch::Contains("a maximum at every step"));
  for (const Plot& plot : pcm_plots(std::vector{run}))
    for (const PlotSeries& series : plot.series) CHECK(series.points.size() == vertices);
}

TEST_CASE("With 1000 outliers the clique of Manhattan consists of true closures", "[pcm]") {
  const auto file = shared_data("pose_graphs/2d/manhattan.g2o");
  if (!file) return;
  ClosureChoice selection;
  selection.outliers = 1000;
  PcmConfig config;
  config.odometry_gate = true;
  const PcmRun run = run_pcm(read_closures(*file, {}, selection).closures, config);
  // The gate is lenient if odometry is uncertain, but drops no more than the 1 % of true closures
  // that its confidence allows.
  CHECK(run.dropped_true <= 20);
  CHECK(run.dropped_false >= 500);
  const PcmAddition& last = run.additions.back();
  CHECK(last.clique == last.bound);
  CHECK(*last.true_members >= 1900);
  CHECK(last.clique - *last.true_members <= 5);
}

ConsistencyRows rows_of(const std::string& text) {
  std::istringstream in(text);
  return read_consistency_rows(in, "graph.txt");
}

TEST_CASE("Empty lines of a consistency graph are isolated vertices", "[pcm]") {
  const ConsistencyRows rows = rows_of("5\n\n\n1 0 \n2\r\n\n");
  CHECK(rows == ConsistencyRows{{}, {}, {0, 1}, {2}, {}});
  CHECK(rows_of("0\n").empty());
}

TEST_CASE("An invalid consistency graph is refused with its line", "[pcm]") {
  const auto [text, message] = GENERATE(table<std::string, std::string>(
      {{"", "graph.txt:1: must be the number of vertices"},
       {"\n3\n", "graph.txt:1: must be the number of vertices"},
       {"x\n", "graph.txt:1: number of vertices is not an integer"},
       {"2 3\n", "graph.txt:1: more than the number of vertices"},
       {"900000\n", "from 0 to 100000: '900000'"},
       {"3\n\n0\n", "graph.txt: ends after 3 lines, 3 vertices"},
       {"2\n\n0\n0\n", "graph.txt:4: more lines than vertices"},
       {"2\n\n1\n", "graph.txt:3: neighbour 1 of vertex 1 is not an earlier one"},
       {"2\n\n-1\n", "graph.txt:3: neighbour is not an integer"},
       {"2\n\n0 0\n", "graph.txt:3: a neighbour of vertex 1 is given twice"}}));
  CAPTURE(text);
  CHECK_THROWS_WITH(rows_of(text), Contains(message));
}

TEST_CASE("Labels apply to false closures in either order of keyframes", "[pcm]") {
  std::istringstream good("9 3 1\n4 8 0\n1 5 1\n");
  CHECK(read_outlier_labels(good, "labels") == KeyframePairs{{1, 5}, {3, 9}});
  std::istringstream flag("1 5 2\n");
  CHECK_THROWS_WITH(read_outlier_labels(flag, "labels"), Contains("labels:1: label"));
  std::istringstream surplus("1 5 0\n1 5 1 9\n");
  CHECK_THROWS_WITH(read_outlier_labels(surplus, "labels"), Contains("labels:2: more fields"));
}

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

std::size_t count_outliers(const std::vector<LabelledClosure>& closures) {
  return static_cast<std::size_t>(
      std::count_if(closures.begin(), closures.end(), [](const auto& c) { return c.outlier; }));
}

TEST_CASE("Closures come from the file, labelled, with random ones among them", "[pcm]") {
  const TemporaryFolder folder;
  const auto file = folder.write("chain.g2o", chain_g2o(20, {{0, 5}, {9, 2}, {3, 15}, {4, 16}}));
  ClosureChoice selection;
  selection.shuffle = false;
  SECTION("in the order of the file") {
    const auto closures = read_closures(file, {{2, 9}}, selection).closures;
    REQUIRE(closures.size() == 4);
    CHECK(closures[1].closure.from.id.index == 9);
    CHECK(closures[1].outlier);
    CHECK(count_outliers(closures) == 1);
    CHECK(closures[2].closure.to.T_odom_kf.translation().x() == Approx(15.0));
  }
  SECTION("some of them, with random ones last") {
    selection.keep = 2;
    selection.outliers = 30;
    const auto closures = read_closures(file, {}, selection).closures;
    REQUIRE(closures.size() == 32);
    CHECK(count_outliers({closures.begin() + 2, closures.end()}) == 30);
    for (const auto& [closure, outlier] : closures)
      CHECK(closure.covariance == closures.front().closure.covariance);
  }
  SECTION("shuffled by the seed") {
    selection.outliers = 30;
    selection.shuffle = true;
    const auto one = read_closures(file, {}, selection).closures;
    const auto same = read_closures(file, {}, selection).closures;
    CHECK(std::equal(one.begin(), one.end(), same.begin(), [](const auto& x, const auto& y) {
      return x.closure.id() == y.closure.id() && x.outlier == y.outlier;
    }));
    CHECK(count_outliers({one.begin(), one.begin() + 30}) < 30);
  }
}

TEST_CASE("A pose graph without enough closures is refused", "[pcm]") {
  const TemporaryFolder folder;
  ClosureChoice selection;
  const auto none = folder.write("none.g2o", chain_g2o(5, {}));
  CHECK_THROWS_WITH(read_closures(none, {}, selection), Contains("none.g2o: has no loop closure"));
  const auto two = folder.write("two.g2o", chain_g2o(5, {{0, 3}, {1, 4}}));
  selection.keep = 3;
  CHECK_THROWS_WITH(read_closures(two, {}, selection),
                    Contains("has 2 loop closures, 3 were asked for"));
  const auto gap = folder.write("gap.g2o",
                                "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n"
                                "EDGE_SE2 0 3 1 0 0 1 0 0 1 0 1\n");
  CHECK_THROWS_WITH(read_closures(gap, {}, {}), Contains("gap.g2o: no odometry"));
}

}  // namespace
}  // namespace km
