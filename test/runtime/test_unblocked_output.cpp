#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

namespace km {
namespace {

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

TEST_CASE("The end of a program writes all text of both streams in order", "[output]") {
  TwoStreams program;
  program.start(1000);
  std::vector<std::string> expected;
  for (int i = 0; i < 1000; ++i)
    for (const char* stream : {"out ", "err "}) expected.push_back(stream + std::to_string(i));
  CHECK(program.read() == expected);
  CHECK(program.ends_well());
}

TEST_CASE("A reader that has stopped does not stop the program, and lost lines are counted",
          "[output]") {
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
