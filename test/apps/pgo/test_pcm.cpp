#include <catch2/catch.hpp>

#include <string>

#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

const std::string kTool = std::string(KM_BIN_DIR) + "/kimera_multi_pgo pcm ";

// A triangle, and a vertex on its own.
constexpr const char* kGraph = "4\n\n0\n\n0 1\n";

TEST_CASE("pcm prints a table and writes JSON and a plot", "[pcm]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("graph.txt", kGraph).string();
  const auto result = run_command(kTool + graph + " --search exact batch --json " +
                                  (folder.path() / "out.json").string() + " --plot " +
                                  (folder.path() / "out.svg").string());
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output, Contains("vertices  clique") &&
                                Contains("exact search: 3 consistent") &&
                                Contains("batch search: 3 consistent"));
  CHECK_THAT(folder.read("out.json"), Contains("\"search\": \"batch\""));
  CHECK_THAT(folder.read("out.svg"), Catch::StartsWith("<svg") && !Contains(">incremental<"));
}

TEST_CASE("pcm says what is wrong with its input", "[pcm]") {
  const TemporaryFolder folder;
  const std::string graph = folder.write("graph.txt", kGraph).string();
  const std::string bad = folder.write("bad.txt", "2\n\n7\n").string();
  const std::string other = folder.write("graph.csv", kGraph).string();
  const auto fails_with = [](const std::string& arguments, const std::string& message) {
    const auto result = run_command(kTool + arguments);
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

}  // namespace
}  // namespace km
