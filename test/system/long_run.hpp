#pragma once

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "modules/recorded_graph/g2o_io.hpp"
#include "test/support/patience.hpp"

namespace km {

/// A full pipe without a reader.
class FullPipe {
 public:
  FullPipe() {
    REQUIRE(pipe2(ends_.data(), O_CLOEXEC | O_NONBLOCK) == 0);
    const std::array<char, 4096> bytes{};
    while (write(ends_[1], bytes.data(), bytes.size()) > 0) {
    }
    fcntl(ends_[1], F_SETFL, 0);  // further writes block
  }
  ~FullPipe() {
    close(ends_[0]);
    close(ends_[1]);
  }
  FullPipe(const FullPipe&) = delete;
  FullPipe& operator=(const FullPipe&) = delete;

  [[nodiscard]] int writer() const { return ends_[1]; }

 private:
  std::array<int, 2> ends_{};
};

/// A program whose standard output and error go to a descriptor; it is killed with this.
class Child {
 public:
  Child(const std::vector<std::string>& command, int output) {
    std::vector<char*> arguments;
    arguments.reserve(command.size() + 1);
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    pid_ = fork();
    REQUIRE(pid_ >= 0);
    if (pid_ > 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    signal(SIGPIPE, SIG_DFL);
    dup2(output, STDOUT_FILENO);
    dup2(output, STDERR_FILENO);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  ~Child() {
    if (pid_ <= 0) return;
    kill(SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  void kill(int signal) const { ::kill(pid_, signal); }

  static constexpr int kRunsOn = -1000;

  /// Its exit code, minus the signal that ended it, or kRunsOn.
  int wait(std::chrono::seconds patience = kPatience) {
    const auto end = std::chrono::steady_clock::now() + patience;
    int status = 0;
    pid_t ended = 0;
    while ((ended = waitpid(pid_, &status, WNOHANG)) == 0 && std::chrono::steady_clock::now() < end)
      poll(nullptr, 0, 20);
    if (ended == 0) return kRunsOn;
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  pid_t pid_ = 0;
};

/// A walk of one robot that takes longer than any test, in `folder`.
inline std::filesystem::path long_walk(const std::filesystem::path& folder, RobotId robot) {
  G2oGraph graph;
  RelativePose step;
  step.T_from_to.translation() = Eigen::Vector3d(1.0, 0.0, 0.0);
  step.covariance = 1e-4 * Matrix6::Identity();
  for (std::uint32_t i = 0; i < 5000; ++i) {
    step.from = {robot, i};
    step.to = {robot, i + 1};
    graph.edges.push_back(step);
  }
  std::filesystem::path file = folder / ("walk" + std::to_string(robot) + ".g2o");
  write_g2o(file, graph);
  return file;
}

/// Waits until `file` has `lines` lines.
inline bool wait_for_lines(const std::filesystem::path& file, int lines) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < end) {
    std::ifstream in(file);
    int count = 0;
    for (std::string line; std::getline(in, line);) ++count;
    if (count >= lines) return true;
    poll(nullptr, 0, 50);
  }
  return false;
}

}  // namespace km
