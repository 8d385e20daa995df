#include <catch2/catch.hpp>

#include "test/support/command.hpp"

namespace km {
namespace {

using Catch::Contains;

const std::string kTool = KM_BIN_DIR "/kimera_multi_pgo ";

TEST_CASE("Without a subcommand the program lists its subcommands", "[pgo]") {
  const std::string arguments =
      GENERATE("", "graph.g2o", "graph.g2o --method newton", "best a.g2o");
  CAPTURE(arguments);
  const CommandResult result = run_command(kTool + arguments);
  CHECK(is_refused(result));
  CHECK_THAT(result.output, Contains("first word must be a subcommand") && Contains("\n  solve ") &&
                                Contains("\n  pcm ") && Contains("\n  outliers "));
}

TEST_CASE("The help of every subcommand has examples and only its own options", "[pgo]") {
  const auto [subcommand, own, other] = GENERATE(
      table<std::string, std::string, std::string>({{"solve", "--trust-all", "--search"},
                                                    {"pcm", "--search", "--robots"},
                                                    {"outliers", "--shares", "--no-vertical"}}));
  const CommandResult help = run_command(kTool + subcommand + " --help");
  CHECK(help.exit_code == 0);
  CHECK_THAT(help.output, Contains("kimera_multi_pgo " + subcommand + " [OPTIONS] FILE") &&
                              Contains("Examples:\n  kimera_multi_pgo " + subcommand) &&
                              Contains(own) && !Contains(other));
}

}  // namespace
}  // namespace km
