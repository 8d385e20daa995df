#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "runtime/unblocked_output.hpp"
#include "test/support/patience.hpp"

namespace km {
namespace {

constexpr double kPatience_s = std::chrono::duration<double>(kPatience).count();

// A pipe that is read line by line.
class Pipe {
 public:
  Pipe() { REQUIRE(pipe2(ends_.data(), O_CLOEXEC) == 0); }
  ~Pipe() {
    close_reader();
    close(ends_[1]);
  }

  [[nodiscard]] int writer() const { return ends_[1]; }
  void close_reader() {
    if (ends_[0] >= 0) close(ends_[0]);
    ends_[0] = -1;
  }
  // Writes lines until the pipe is full, so that the next writer waits.
  void fill() {
    const int flags = fcntl(ends_[1], F_GETFL);
    REQUIRE(fcntl(ends_[1], F_SETFL, flags | O_NONBLOCK) == 0);
    while (::write(ends_[1], "\n", 1) == 1) {
    }
    REQUIRE(fcntl(ends_[1], F_SETFL, flags) == 0);
  }
  // Reads up to and with the first line that ends so.
  std::vector<std::string> read_to(const std::string& ending) {
    std::vector<std::string> lines;
    std::string line;
    char c = 0;
    while (::read(ends_[0], &c, 1) == 1) {
      if (c != '\n') {
        line += c;
        continue;
      }
      lines.push_back(line);
      if (line.ends_with(ending)) break;
      line.clear();
    }
    return lines;
  }

 private:
  std::array<int, 2> ends_{};
};

std::string numbered(int i) {
  return "line " + std::to_string(i);
}

TEST_CASE("Queued text is written completely and in order", "[output]") {
  constexpr int kLines = 20000;  // more than a pipe can hold
  Pipe pipe;
  std::vector<std::string> lines;
  std::thread reader([&] { lines = pipe.read_to(numbered(kLines - 1)); });
  {
    UnblockedOutput queue(pipe.writer(), kLines);
    for (int i = 0; i < kLines; ++i) queue.write(numbered(i) + '\n');
  }  // writes the rest
  reader.join();
  REQUIRE(lines.size() == kLines);
  for (int i = 0; i < kLines; ++i) REQUIRE(lines[static_cast<std::size_t>(i)] == numbered(i));
}

TEST_CASE("A blocked output delays no caller, and lost lines are counted in their place",
          "[output]") {
  constexpr int kLines = 20000;
  Pipe pipe;
  pipe.fill();  // without a reader; a queue that could still write would have room again in between
  constexpr int kKept = 50;
  UnblockedOutput queue(pipe.writer(), kKept);
  for (int i = 0; i < kLines; ++i) queue.write(numbered(i) + '\n');
  auto lines = pipe.read_to(numbered(kLines - 1));
  std::erase(lines, "");
  // The thread may take a line, or the number of lost lines, before newer lines displace others.
  int next = 0;
  for (const std::string& line : lines)
    if (const auto end = line.find(" lines lost: output blocked or failed"); end != line.npos)
      next += std::stoi(line.substr(0, end));
    else
      CHECK(line == numbered(next++));
  CHECK(next == kLines);
  CHECK(lines.size() >= kKept + 1U);
  CHECK(lines.size() <= kKept + 3U);
  queue.write("news\n");
  CHECK(pipe.read_to("news") == std::vector<std::string>{"news"});
}

TEST_CASE("An output that stays blocked does not delay the end", "[output]") {
  Pipe pipe;
  {
    UnblockedOutput queue(pipe.writer());
    for (int i = 0; i < 20000; ++i) queue.write(numbered(i) + '\n');
    CHECK_FALSE(queue.drain(0.01));
  }
  SUCCEED("the queue has gone, its thread has not");
}

TEST_CASE("A closed pipe is an error of a write and not the end of the process", "[output]") {
  const auto before = std::signal(SIGPIPE, SIG_DFL);
  Pipe pipe;
  pipe.close_reader();
  {
    UnblockedOutput queue(pipe.writer());
    for (int i = 0; i < 100; ++i) queue.write(numbered(i) + '\n');
    CHECK(queue.drain(kPatience_s));
  }
  std::signal(SIGPIPE, before);
}

TEST_CASE("A full disk costs the lines that it refuses, and their number is written later",
          "[output]") {
  Pipe pipe;
  UnblockedOutput queue(pipe.writer());
  const int working = dup(pipe.writer());
  const int full = open("/dev/full", O_WRONLY | O_CLOEXEC);
  REQUIRE(full >= 0);
  REQUIRE(dup2(full, pipe.writer()) >= 0);
  queue.write("one\ntwo\n");
  queue.write("three\n");
  CHECK(queue.drain(kPatience_s));
  REQUIRE(dup2(working, pipe.writer()) >= 0);
  queue.write("four\n");
  CHECK(pipe.read_to("four") ==
        std::vector<std::string>{"3 lines lost: output blocked or failed", "four"});
  close(working);
  close(full);
}

TEST_CASE("The end of a program writes all text of both streams, in order if they are one file",
          "[output]") {
  Pipe pipe;
  const pid_t child = fork();
  if (child == 0) {
    dup2(pipe.writer(), STDOUT_FILENO);
    dup2(pipe.writer(), STDERR_FILENO);
    execl(KM_BIN_DIR "/test_two_streams", "test_two_streams", nullptr);
    _exit(127);
  }
  std::vector<std::string> expected;
  for (int i = 0; i < 1000; ++i) {
    expected.push_back("out " + std::to_string(i));
    expected.push_back("err " + std::to_string(i));
  }
  CHECK(pipe.read_to("err 999") == expected);
}

}  // namespace
}  // namespace km
