#include <regex>

#include "modules/evaluation/trajectory_file.hpp"
#include "modules/recorded_graph/g2o_io.hpp"
#include "test/support/command.hpp"
#include "test/support/shared_data.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::string kSolveTool = KM_BIN_DIR "/kimera_multi_pgo solve ";

// A square driven twice in the plane, its second lap joined to the first by closures.
std::string square_g2o() {
  std::string text;
  const auto edge = [&](int i, int j, const char* measured) {
    text += "EDGE_SE2 " + std::to_string(i) + ' ' + std::to_string(j) + ' ' + measured +
            " 4 0 0 4 0 9\n";
  };
  for (int i = 0; i < 7; ++i) edge(i, i + 1, "1.02 0.01 1.58");
  for (int i = 0; i < 4; ++i) edge(i, i + 4, "0.01 -0.02 0.005");
  return text;
}

// A square in space, driven twice. Every pose except for the first has a vertical.
std::string upright_square_g2o() {
  G2oGraph graph;
  const auto edge = [&](std::uint32_t i, std::uint32_t j, double angle, double x) {
    const Eigen::AngleAxisd R(angle, Eigen::Vector3d::UnitZ());
    graph.edges.push_back({{0, i},
                           {0, j},
                           make_pose(R.toRotationMatrix(), {x, 0.02, 0.01}),
                           1e-2 * Matrix6::Identity()});
  };
  for (std::uint32_t i = 0; i < 7; ++i) edge(i, i + 1, 1.58, 1.02);
  for (std::uint32_t i = 0; i < 4; ++i) edge(i, i + 4, 0.005, 0.01);
  for (std::uint32_t i = 1; i < 8; ++i)
    graph.verticals.push_back({{0, i}, {Eigen::Vector3d(0.02, -0.01 * i, 1.0).normalized(), 0.01}});
  std::ostringstream text;
  write_g2o(text, graph);
  return text.str();
}

}  // namespace

TEST_CASE("Every method runs from the command line and prints its result") {
  const TemporaryFolder folder;
  const auto graph = folder.write("square.g2o", square_g2o());
  const auto json = folder.path() / "out.json";
  const std::string method =
      GENERATE("local", "rbcd", "newton --trust-all", "centralized", "rbcd --over-relaxation 1");
  CAPTURE(method);
  const CommandResult result = succeeded(run_command(
      kSolveTool + graph.string() + " --robots 2 --method " + method + " --json " + json.string()));
  CHECK_THAT(result.output, Contains("8 poses, 10 edges, 2 robots"));
  const std::string written = folder.read("out.json");
  for (const char* key :
       {"poses", "edges", "robots", "method", "rounds", "cost", "gradient_norm", "bytes",
        "critical_path_s", "total_cpu_s", "rounded_cost", "lambda_bound", "certified"})
    CHECK_THAT(written, Contains(std::string("\"") + key + "\":"));
}

TEST_CASE("Robots that are not joined are named") {
  const TemporaryFolder folder;
  const std::string joined = square_g2o();
  const std::string apart = joined.substr(0, joined.find("EDGE_SE2 1 5")) +
                            "EDGE_SE2 3 7 300 0 2 4 0 0 4 0 9\n";  // contradicts 0 4
  const std::string named = "robots 0 | 1 have different frames";
  const auto solve = [&](const std::string& text) {
    const auto graph = folder.write("graph.g2o", text);
    return succeeded(run_command(kSolveTool + graph.string() + " --robots 2")).output;
  };
  CHECK_THAT(solve(apart), Contains(named));
  CHECK_THAT(solve(joined), !Contains(named));
}

TEST_CASE("Poses are written as TUM and g2o") {
  const TemporaryFolder folder;
  const auto graph = folder.write("square.g2o", square_g2o());
  const auto tum = folder.path() / "poses.tum";
  const auto g2o = folder.path() / "poses.g2o";
  for (const auto& output : {tum, g2o})
    REQUIRE(run_command(kSolveTool + graph.string() + " --method centralized --output " +
                        output.string())
                .exit_code == 0);
  const G2oGraph written = read_g2o(g2o);
  REQUIRE(written.vertices.size() == 8);
  CHECK(written.edges.size() == 11);
  const std::vector<StampedPose> rows = read_trajectory(tum);
  REQUIRE(rows.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) {
    CHECK(rows[i].stamp == nanoseconds(static_cast<double>(i)));
    CHECK((rows[i].T.matrix() - written.vertices[i].T_world_kf.matrix()).norm() < 1e-12);
  }
}

TEST_CASE("A graph without noise is certified and has no gap") {
  const TemporaryFolder folder;
  const auto graph = folder.write("exact.g2o", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n");
  const auto json = folder.path() / "out.json";
  const CommandResult result =
      succeeded(run_command(kSolveTool + graph.string() +
                            " --robots 2 --keep-steps --method rbcd --json " + json.string()));
  CHECK_THAT(result.output, !Contains("nan") && Contains("\ncertified"));
  CHECK_THAT(folder.read("out.json"), !Contains("nan") && Contains("\"certified\": true"));
}

TEST_CASE("newton decides on closures and reports their noise") {
  const TemporaryFolder folder;
  const std::string square = folder.write("square.g2o", square_g2o()).string();
  const std::string step = folder.write("step.g2o", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n").string();
  const auto json = folder.path() / "out.json";
  for (const std::string& arguments : {step, square + " --robots 2"}) {
    const CommandResult result = run_command(kSolveTool + arguments + " --json " + json.string());
    CAPTURE(arguments, result.output);
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.output, !Contains("not decided") && Contains("as noisy as the graph says"));
    CHECK_THAT(folder.read("out.json"),
               Contains("\"decided\": true") && Contains("\"noise_scale\":"));
  }
}

TEST_CASE("solve refuses unusable input and options with the reason") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("square.g2o", square_g2o()).string();
  (void)folder.write("lone.g2o", "VERTEX_SE2 0 0 0 0\n");
  const std::string unit = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";
  (void)folder.write("far.g2o", "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1" + unit +
                                    "EDGE_SE3:QUAT 1 2 1e308 0 0 0 0 0 1" + unit);
  // FILE and PLACE stand for the graph and its folder.
  const auto [pattern, message] = GENERATE(table<std::string, std::string>(
      {{"FILE --robots 9", "8 poses, which cannot be divided among 9 robots"},
       {"FILE --method local --over-relaxation 1.5", "--over-relaxation is for"},
       {"FILE --method rbcd --trust-all", "--trust-all is for --method newton only"},
       {"FILE --json /nowhere/out.json", "there is no folder /nowhere"},
       {"FILE --json PLACE", "it is a folder"},
       {"PLACE/lone.g2o", "lone.g2o: no edge"},
       {"PLACE/far.g2o", "far.g2o:2: translation 1e+308 is outside -1e+06 .. 1e+06"},
       {"FILE --output poses.txt", "--output writes *.tum or *.g2o"},
       {"FILE --method fastest", "fastest not in {local,rbcd,centralized"}}));
  const auto place = std::regex_replace(pattern, std::regex("PLACE"), folder.path().string());
  const auto arguments = std::regex_replace(place, std::regex("FILE"), graph);
  CAPTURE(arguments);
  const CommandResult result = run_command(kSolveTool + arguments);
  CHECK(is_refused(result));
  CHECK_THAT(result.output, Contains(message));
}

TEST_CASE("The cost of a planar graph is that of the plane") {
  const auto file = shared_data("pose_graphs/2d/intel.g2o");
  if (!file) return;
  const CommandResult result = succeeded(
      run_command(kSolveTool + file->string() + " --robots 5 --keep-steps --method centralized"));
  // Optimum of SE-Sync.
  std::smatch optimum;
  REQUIRE(std::regex_search(result.output, optimum, std::regex("optimum ([0-9.]+)")));
  CHECK(std::stod(optimum[1]) == Approx(52.3482273).epsilon(4e-8));
  CHECK_THAT(result.output, Contains("\ncertified"));
}

TEST_CASE("Verticals of the file are used, reported and written") {
  const TemporaryFolder folder;
  const auto graph = folder.write("square.g2o", upright_square_g2o());
  const auto json = folder.path() / "out.json";
  const auto solved = folder.path() / "solved.g2o";
  const std::string method = GENERATE("newton --trust-all", "rbcd", "centralized", "local");
  CAPTURE(method);
  const std::string options = graph.string() + " --robots 2 --rounds 300 --method " + method;
  const CommandResult result = succeeded(run_command(
      kSolveTool + options + " --json " + json.string() + " --output " + solved.string()));
  CHECK_THAT(result.output, Contains("8 poses, 10 edges, 7 verticals, 2 robots"));
  CHECK_THAT(folder.read("out.json"), Contains("\"verticals\": 7"));
  const G2oGraph written = read_g2o(solved);
  CHECK(written.verticals.size() == 7);
  const auto worst_tilt = [](const G2oGraph& g) {
    double worst = 0.0;
    for (const G2oVertex& v : g.vertices)
      worst = std::max(worst, std::acos(std::min(1.0, v.T_world_kf.linear()(2, 2))));
    return worst;
  };
  CHECK(worst_tilt(written) < 0.1);
  if (method != "local") CHECK_THAT(result.output, Contains("\ncertified"));

  const CommandResult without =
      run_command(kSolveTool + options + " --no-vertical --json " + json.string());
  CHECK(without.exit_code == 0);
  CHECK_THAT(without.output, Contains("8 poses, 10 edges, 2 robots"));
  CHECK_THAT(folder.read("out.json"), Contains("\"verticals\": 0"));
}

}  // namespace km
