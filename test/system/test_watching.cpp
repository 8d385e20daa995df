#include <catch2/catch.hpp>
#include <string>

#include "test/system/audience.hpp"

// Robots and a viewer, over the network.

namespace km {
namespace {

TEST_CASE("A viewer receives nothing without --view, and nothing from a team with keys",
          "[system][view]") {
  const bool has_keys = GENERATE(false, true);
  CAPTURE(has_keys);
  const TemporaryFolder folder;
  const int domain = random_domain();
  Audience audience(domain);
  std::string command;
  for (const std::string& word : robot_on({0, 0}, {1, 40}, folder.path(), domain))
    command += word + ' ';
  if (has_keys) {
    make_keys(folder.path() / "keys", "robot0:0");
    command += "--view --security " + (folder.path() / "keys/robot0").string();
  }
  const CommandResult robot = run_command(command);
  CAPTURE(robot.output);
  CHECK(robot.exit_code == 0);
  CHECK(audience.finish().empty());
  CHECK((robot.output.find("without encryption") != std::string::npos) == has_keys);
}

}  // namespace
}  // namespace km
