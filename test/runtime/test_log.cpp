#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <regex>

#include "runtime/log.hpp"
#include "test/support/captured_log.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

TEST_CASE("A rate limit passes one message per interval and counts the others") {
  RateLimit limit(5.0);
  CHECK(limit.ask("a", 0.0).pass);
  CHECK_FALSE(limit.ask("a", 1.0).pass);
  CHECK_FALSE(limit.ask("a", 4.9).pass);
  CHECK(limit.ask("b", 1.0).pass);  // another key, its own interval
  const auto verdict = limit.ask("a", 5.0);
  CHECK(verdict.pass);
  CHECK(verdict.held_back == 2);
  CHECK(limit.ask("a", 10.0).held_back == 0);
}

TEST_CASE("A listener of the log receives the written lines until another replaces it") {
  CapturedLog log;
  std::vector<log::Entry> received;
  log::set_listener([&received](const log::Entry& entry) { received.push_back(entry); });
  log::warn("vio") << "slow: " << 3 << " s";
  log::debug("vio") << "below the limit";
  log::set_listener({});
  log::warn("vio") << "to nobody";
  REQUIRE(received.size() == 1);
  CHECK(received[0].level == log::Level::kWarn);
  CHECK(received[0].tag == "vio");
  CHECK(received[0].text == "slow: 3 s");
  CHECK(log.lines().size() == 2);
}

TEST_CASE("Lines of several threads are never mixed") {
  const CapturedLog captured;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([] {
      for (int i = 0; i < 200; ++i) log::info("test") << "begin " << i << " middle " << i << " end";
    });
  for (std::thread& thread : threads) thread.join();
  const auto lines = captured.lines();
  CHECK(lines.size() == 800);
  const std::regex whole("[0-9:.]+ info test: begin [0-9]+ middle [0-9]+ end");
  for (const std::string& line : lines) CHECK(std::regex_match(line, whole));
}

TEST_CASE("On a terminal the status line is redrawn below the log lines") {
  CapturedLog captured;
  {
    StatusLine status(captured.stream(), true);
    status.update("state 1");
    log::info("test") << "news";
    status.update("state 2");
  }
  const std::string text =
      std::regex_replace(captured.stream().str(), std::regex("[0-9:.]+ info"), "info");
  const std::string erase = "\r\033[K";
  CHECK(text ==
        erase + "state 1" + erase + "info test: news\n" + erase + "state 1" + erase + "state 2\n");
}

TEST_CASE("Without a terminal the status is printed as plain lines, the last one always") {
  std::ostringstream output;
  {
    StatusLine status(output, false, 1000.0);
    for (int i = 0; i < 10; ++i) status.update("state " + std::to_string(i));
  }
  CHECK(output.str() == "state 0\nstate 9\n");
}

// The program two_streams, with both streams on one pipe.
class TwoStreams {
 public:
  TwoStreams() { REQUIRE(pipe2(ends_.data(), O_CLOEXEC) == 0); }
  ~TwoStreams() {
    for (const int end : ends_) close(end);
  }

  // Writes lines until the pipe is full, so that the next writer waits.
  void fill() const {
    const int flags = fcntl(ends_[1], F_GETFL);
    REQUIRE(fcntl(ends_[1], F_SETFL, flags | O_NONBLOCK) == 0);
    while (::write(ends_[1], "\n", 1) == 1) {
    }
    REQUIRE(fcntl(ends_[1], F_SETFL, flags) == 0);
  }
  void start(int lines) {
    child_ = fork();
    if (child_ == 0) {
      dup2(ends_[1], STDOUT_FILENO);
      dup2(ends_[1], STDERR_FILENO);
      execl(KM_BIN_DIR "/test_two_streams", "test_two_streams", std::to_string(lines).c_str(),
            nullptr);
      _exit(127);
    }
    close(ends_[1]);
  }
  // The rest of the lines.
  [[nodiscard]] std::vector<std::string> read() const {
    std::vector<std::string> lines;
    std::string line;
    for (char c = 0; ::read(ends_[0], &c, 1) == 1;)
      if (c != '\n')
        line += c;
      else if (!line.empty())
        lines.push_back(std::exchange(line, {}));
    return lines;
  }
  // Waits for the end of the program.
  [[nodiscard]] bool ends_well() const {
    int status = 0;
    return waitpid(child_, &status, 0) == child_ && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }

 private:
  std::array<int, 2> ends_{-1, -1};
  pid_t child_ = -1;
};

TEST_CASE("The end of a program writes all text of both streams in order") {
  TwoStreams program;
  program.start(1000);
  std::vector<std::string> expected;
  for (int i = 0; i < 1000; ++i)
    for (const char* stream : {"out ", "err "}) expected.push_back(stream + std::to_string(i));
  CHECK(program.read() == expected);
  CHECK(program.ends_well());
}

TEST_CASE("A reader that has stopped does not stop the program, and lost lines are counted") {
  constexpr int kLines = 20000;
  TwoStreams program;
  program.fill();
  program.start(kLines);
  SECTION("it never reads again") {
    CHECK(program.ends_well());
  }
  SECTION("it reads later") {
    std::size_t lines = 0, lost = 0;
    for (const std::string& line : program.read())
      if (const auto end = line.find(" lines lost: output blocked or failed"); end != line.npos)
        lost += std::stoul(line.substr(0, end));
      else
        ++lines;
    CHECK(lines + lost == 2 * kLines);
    CHECK(program.ends_well());
  }
}

}  // namespace
}  // namespace km
