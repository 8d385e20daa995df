#include <catch2/catch.hpp>
#include <string>

#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

const std::string kTool = KM_BIN_DIR "/kimera_multi_pgo outliers ";

// A square driven round five times in the plane, each lap tied to the one before.
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
      kTool + graph + " --robots 2 --shares 12.5,25 --seeds 1,2 --outlier-range 20 " + "--json " +
      (folder.path() / "out.json").string() + " --plot " + (folder.path() / "out.svg").string());
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
  CHECK_THAT(folder.read("out.svg"),
             Catch::StartsWith("<svg") && Contains(">pcm+newton<") && Contains("<circle"));
}

TEST_CASE("Clusters of false closures are added on request", "[outliers]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("laps.g2o", laps_g2o()).string();
  const CommandResult result = run_command(
      kTool + graph + " --robots 2 --shares 0 --methods newton --clusters 2 --cluster-size 3");
  CAPTURE(result.output);
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.output, Contains("newton    0 %      6"));
}

TEST_CASE("outliers says what is wrong with its input", "[outliers]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("laps.g2o", laps_g2o()).string();
  const auto fails_with = [](const std::string& arguments, const std::string& message) {
    const CommandResult result = run_command(kTool + arguments);
    CAPTURE(arguments, result.output);
    CHECK(result.exit_code == 1);
    CHECK_THAT(result.output, Contains(message));
  };
  fails_with("", "FILE is required");
  fails_with(graph + " --methods best", "best not in");
  fails_with(graph + " --shares -5", "--shares");
  fails_with(graph + " --pcm-sigmas 0", "--pcm-sigmas");
  fails_with(graph + " --robots 30", "20 poses, which cannot be dealt out to 30 robots");
  fails_with(graph + " --json /nowhere/out.json", "there is no folder /nowhere");
  fails_with(folder.write("steps.g2o", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n").string() + " --robots 1",
             "no loop closure");
}

}  // namespace
}  // namespace km
