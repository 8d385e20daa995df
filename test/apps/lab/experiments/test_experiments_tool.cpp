#include <catch2/catch.hpp>
#include <sstream>
#include <string>

#include "test/support/command.hpp"
#include "test/support/page_text.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;
namespace fs = std::filesystem;

const std::string kTool = std::string(KM_BIN_DIR) + "/kimera_multi_experiments ";

// Twice around a regular polygon: every pose of the second round closes a loop with the first.
std::string polygon_graph() {
  constexpr int kCorners = 20;
  std::ostringstream g2o;
  const auto edge = [&](int from, int to, double x, double angle) {
    g2o << "EDGE_SE2 " << from << ' ' << to << ' ' << x << " 0 " << angle
        << " 100 0 0 100 0 1000\n";
  };
  for (int i = 0; i < 2 * kCorners; ++i) g2o << "VERTEX_SE2 " << i << " 0 0 0\n";
  for (int i = 1; i < 2 * kCorners; ++i) edge(i - 1, i, 1.0, 6.283185307 / kCorners);
  for (int i = 0; i < kCorners; ++i) edge(i, i + kCorners, 0.0, 0.0);
  return g2o.str();
}

// The shipped configuration with a small graph, in folders of its own.
struct Laboratory {
  TemporaryFolder folder;
  Laboratory() {
    fs::copy("config", folder.path() / "config", fs::copy_options::recursive);
    folder.write("config/experiments/pcm.yaml",
                 "graph: polygon.g2o\noutliers: 1000\nseeds: [1, 2]\nsearches: [batch, exact]\n"
                 "quick: {outliers: 30}\n");
    folder.write("graphs/polygon.g2o", polygon_graph());
  }
  CommandResult run(const std::string& arguments) const {
    const std::string root = folder.path().string();
    return bare(arguments + " --quick --config " + root + "/config/experiments --graphs " + root +
                "/graphs --data " + root + "/data");
  }
  CommandResult bare(const std::string& arguments) const {
    return run_command(kTool + arguments + " --results " + (folder.path() / "results").string());
  }
};

TEST_CASE("The quick pcm experiment runs, reports, and is not run twice", "[experiments]") {
  const Laboratory laboratory;
  const CommandResult first = laboratory.run("run pcm");
  CAPTURE(first.output);
  REQUIRE(first.exit_code == 0);
  CHECK_THAT(first.output, Contains("[1/2] consistent closures, seed 1: done in") &&
                               Contains("2 steps made, 0 were done before"));
  const std::string page = laboratory.folder.read("results/report.html");
  CHECK_THAT(page, Contains("search time and clique against vertices") && Contains("--seed 2") &&
                       Contains("--outliers 30") && Contains("small versions") &&
                       Contains("exact search: clique against batch"));
  CHECK_THAT(laboratory.folder.read("results/report.md"), Contains("(report.html#figure-pcm)"));
  CHECK(data_of_page(page, "plots")["figure-pcm"].size() == 2);
  const CommandResult second = laboratory.run("run pcm");
  CHECK_THAT(second.output, Contains("0 steps made, 2 were done before"));
  CHECK_THAT(laboratory.run("list").output, Contains("pcm-1") && Contains("done"));

  const std::string pcm = laboratory.folder.read("config/experiments/pcm.yaml");
  laboratory.folder.write("config/experiments/pcm.yaml", pcm + "closures: 10\n");
  CHECK_THAT(laboratory.run("list").output, Contains("outdated"));
  CHECK_THAT(laboratory.run("run pcm").output, Contains("2 steps made"));
}

TEST_CASE("The inputs of a run are kept with its results", "[experiments]") {
  const Laboratory laboratory;
  const CommandResult empty = laboratory.bare("report");
  CHECK(empty.exit_code == 1);
  CHECK_THAT(empty.output, Contains("nothing to report") && Contains("--results"));
  CHECK_FALSE(fs::exists(laboratory.folder.path() / "results/report.md"));
  REQUIRE(laboratory.run("run pcm").exit_code == 0);
  const std::string before = laboratory.folder.read("results/numbers.json");
  const CommandResult report = laboratory.bare("report");
  CAPTURE(report.output);
  // One of them is a time, which a busy host may miss.
  CHECK_THAT(report.output, Contains(" of 2 numbers to reach are met"));
  CHECK(laboratory.folder.read("results/numbers.json") == before);
  CHECK_THAT(laboratory.bare("list").output,
             Contains((laboratory.folder.path() / "graphs").string()));
  // The command line has priority.
  fs::create_directory(laboratory.folder.path() / "none");
  const CommandResult other =
      laboratory.bare("report --graphs " + (laboratory.folder.path() / "none").string());
  CHECK(other.exit_code == 1);
  CHECK(laboratory.folder.read("results/numbers.json") == before);
}

TEST_CASE("A run with another folder and without new results changes nothing", "[experiments]") {
  const Laboratory laboratory;
  REQUIRE(laboratory.run("run pcm").exit_code == 0);
  const std::string report = laboratory.folder.read("results/report.md");
  // Another graph, with which the program fails; and a folder without any.
  laboratory.folder.write("other/polygon.g2o", "VERTEX_SE2 0 0 0\n");
  fs::create_directory(laboratory.folder.path() / "none");
  const std::string other = (laboratory.folder.path() / GENERATE("other", "none")).string();
  CAPTURE(other);
  const CommandResult fruitless = laboratory.bare("run pcm --graphs " + other);
  CHECK(fruitless.exit_code == 3);
  CHECK_THAT(fruitless.output, Contains("nothing was made"));
  const CommandResult list = laboratory.bare("list");
  CHECK_THAT(list.output, Contains("pcm-1   done") && Contains("pcm-2   done"));
  CHECK(laboratory.folder.read("results/report.md") == report);
  // Inputs of a run that makes results are kept.
  laboratory.folder.write("other/polygon.g2o", polygon_graph() + "\n");
  REQUIRE(laboratory.bare("run pcm --graphs " + (laboratory.folder.path() / "other").string())
              .exit_code == 0);
  CHECK_THAT(laboratory.bare("list").output, Contains("pcm-1   done") && Contains("other"));
}

TEST_CASE("The tool names faults and missing inputs", "[experiments]") {
  const Laboratory laboratory;
  const auto fails_with = [&](const std::string& arguments, int code, const std::string& message) {
    const CommandResult result = laboratory.run(arguments);
    CAPTURE(arguments, result.output);
    CHECK(result.exit_code == code);
    CHECK_THAT(result.output, Contains(message));
  };
  fails_with("", 1, "subcommand is required");
  fails_with("run tea", 1, "tea");
  fails_with("run", 1, "NAME is required");
  fails_with("report --programs " + laboratory.folder.path().string() + "/none", 1, "--programs");
  fails_with("run pcm --programs " + laboratory.folder.path().string(), 3, "no such program");
  fs::remove(laboratory.folder.path() / "graphs/polygon.g2o");
  fails_with("run pcm", 3, "--graphs names its folder");
  laboratory.folder.write("graphs/polygon.g2o", "VERTEX_SE2 0 0 0\n");
  fails_with("run pcm", 3, "polygon.g2o:1");
  laboratory.folder.write("config/experiments/mesh.yaml", "wolds: [city]\n");
  fails_with("list", 1, "mesh.yaml:1: unknown key wolds (did you mean worlds?)");
}

}  // namespace
}  // namespace km
