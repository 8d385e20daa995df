#include <catch2/catch.hpp>
#include <string>

#include "test/system/audience.hpp"

// Robots and a viewer, over the network.

namespace km {
namespace {

TEST_CASE("A viewer receives nothing without --view, and from a team with keys only if enabled",
          "[system][view]") {
  const std::string options = GENERATE("", "--view", "--view --set view.in_clear=true");
  CAPTURE(options);
  const TemporaryFolder folder;
  const int domain = random_domain();
  const std::string keys = (folder.path() / "keys").string();
  make_keys(keys, "robot0:0");
  Audience audience(domain);
  std::string command;
  for (const std::string& word : robot_on({0, 0}, {1, 40}, folder.path(), domain))
    command += word + ' ';
  command += options.empty() ? "" : options + " --security " + keys + "/robot0";
  const CommandResult robot = run_command(command);
  CAPTURE(robot.output);
  CHECK(robot.exit_code == 0);
  CHECK(audience.finish().empty() == !options.ends_with("true"));
  CHECK((robot.output.find("view.in_clear") == std::string::npos) == (options != "--view"));
}

}  // namespace
}  // namespace km
