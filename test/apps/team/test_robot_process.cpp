#include "apps/team/robot_process.hpp"

#include <poll.h>

#include "apps/team/run_team.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

// A shell script as a process; `lines` collects its standard output up to its end.
struct Script {
  TemporaryFolder folder;
  RobotProcess process;
  std::vector<std::string> lines;

  explicit Script(const std::string& text)
      : process({"/bin/sh", "-c", text}, no_signals(), folder.path() / "log") {}

  static sigset_t no_signals() {
    sigset_t set;
    sigemptyset(&set);
    return set;
  }
  void read_once() {
    std::vector<pollfd> fds;
    for (const int fd : process.descriptors()) fds.push_back({fd, POLLIN, 0});
    poll(fds.data(), fds.size(), 50);
    for (std::string& line : process.read()) lines.push_back(std::move(line));
  }
  void wait() {
    while (!process.exit()) read_once();
  }
};

}  // namespace

TEST_CASE("Its standard input is empty and its process group its own") {
  Script script("read x || echo empty; [ $(ps -o pgid= -p $$) = $$ ] && echo leader");
  script.wait();
  CHECK(script.lines == std::vector<std::string>{"empty", "leader"});
}

TEST_CASE("A process that a signal ended names the signal") {
  Script script("kill -9 $$");
  script.wait();
  CHECK_FALSE(script.process.exit()->ok());
  CHECK_THAT(to_string(*script.process.exit()), Contains("signal 9"));
}

TEST_CASE("A program that cannot be started fails with a reason") {
  const TemporaryFolder folder;
  RobotProcess process({folder.path() / "missing"}, Script::no_signals(), folder.path() / "log");
  while (!process.exit()) process.read();
  CHECK(process.exit()->code == 127);
  REQUIRE(process.last_log_lines().size() == 1);
  CHECK_THAT(process.last_log_lines().back(), StartsWith("cannot be started: No such file"));
}

TEST_CASE("A process does not outlive its owner") {
  pid_t child = 0;
  {
    Script script("echo $$; sleep 60");
    while (script.lines.empty()) script.read_once();
    child = std::stoi(script.lines.front());
    CHECK(kill(child, 0) == 0);
  }
  CHECK(kill(child, 0) != 0);
}

TEST_CASE("A process that was asked to end is not asked again") {
  const TemporaryFolder folder;
  {
    Script script(
        "trap 'echo asked >> " + (folder.path() / "diary").string() +
        "' INT TERM; echo ready; for i in $(seq 10); do sleep 0.02; done; echo ended >> " +
        (folder.path() / "diary").string());
    while (script.lines.empty()) script.read_once();
    script.process.send(SIGINT);
  }
  CHECK(folder.read("diary") == "asked\nended\n");
}

TEST_CASE("The display redraws a terminal and prefixes lines elsewhere") {
  std::ostringstream plain;
  TeamDisplay log({"a", "long"}, plain, false, 0);
  log.update(0, "hello");
  log.update(1, "you");
  CHECK(plain.str() == "a    | hello\nlong | you\n");

  std::ostringstream screen;
  TeamDisplay tty({"a", "b"}, screen, true, 20);
  tty.update(0, "x");
  CHECK(screen.str() == "\r\x1b[Ka | x\n\r\x1b[Kb | \n");
  screen.str("");
  tty.update(1, std::string(100, 'y'));
  CHECK(screen.str() == "\x1b[2A\r\x1b[Ka | x\n\r\x1b[Kb | " + std::string(15, 'y') + "\n");
}

}  // namespace km
