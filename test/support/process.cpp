#include "test/support/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <stdexcept>
#include <system_error>

namespace km {
namespace {

// Time to read what a process has printed before its end. A process that it has started may still
// print, so that there is a limit.
constexpr std::chrono::seconds kLastLines(3);

std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    throw std::system_error(errno, std::generic_category(), "pipe");
  return ends;
}

// Between fork and exec: only async-signal-safe calls.
[[noreturn]] void become(char* const* arguments, const std::string& network, int input, int output,
                         bool with_errors) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (with_errors) signal(SIGPIPE, SIG_DFL);
  if (!network.empty()) {
    const int descriptor = open(network.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0 || setns(descriptor, CLONE_NEWNET) != 0) _exit(126);
  }
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  if (with_errors) dup2(output, STDERR_FILENO);
  execvp(arguments[0], arguments);
  _exit(127);
}

}  // namespace

Process::Process(const std::vector<std::string>& command, pid_t network_of,
                 std::optional<int> output) {
  std::signal(SIGPIPE, SIG_IGN);  // the end of the child is detected otherwise
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const std::string network =
      network_of == 0 ? "" : "/proc/" + std::to_string(network_of) + "/ns/net";
  const auto to_child = make_pipe();
  const auto from_child = make_pipe();
  started_ = std::chrono::steady_clock::now();
  pid_ = fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ == 0)
    become(arguments.data(), network, to_child[0], output.value_or(from_child[1]),
           output.has_value());
  close(to_child[0]);
  close(from_child[1]);
  input_ = to_child[1];
  output_ = from_child[0];
  reader_ = std::thread(&Process::read_lines, this);
}

Process::~Process() {
  if (!result_) {
    kill(SIGKILL);
    wait();
  }
  reader_.join();
  close(input_);
  close(output_);
}

void Process::send_line(const std::string& line) {
  const std::string text = line + '\n';
  if (write(input_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    throw std::runtime_error("Process: cannot write to its input");
}

std::optional<TimedLine> Process::wait_for(const std::string& line, std::size_t times,
                                           std::chrono::seconds patience) {
  std::optional<TimedLine> found;
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [&] {
    std::size_t count = 0;
    for (const TimedLine& l : lines_)
      if (l.text == line && ++count == times) found = l;
    return found.has_value() || ended_;
  });
  return found;
}

std::optional<TimedLine> Process::wait_for_prefix(const std::string& prefix) {
  return wait_until([&](const std::string& line) { return line.starts_with(prefix); });
}

std::optional<TimedLine> Process::wait_until(
    const std::function<bool(const std::string&)>& accepts) {
  std::optional<TimedLine> found;
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, kPatience, [&] {
    const auto line =
        std::ranges::find_if(lines_, [&](const TimedLine& l) { return accepts(l.text); });
    if (line != lines_.end()) found = *line;
    return found.has_value() || ended_;
  });
  return found;
}

std::vector<TimedLine> Process::lines(const std::string& prefix) const {
  const std::lock_guard lock(mutex_);
  std::vector<TimedLine> result;
  for (const TimedLine& line : lines_)
    if (line.text.starts_with(prefix)) result.push_back(line);
  return result;
}

void Process::kill(int signal) const {
  ::kill(pid_, signal);
}

int Process::wait() {
  int status = 0;
  while (!result_ && waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  if (!result_) keep_result(status);
  return *result_;
}

std::optional<int> Process::wait_within(std::chrono::seconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  int status = 0;
  while (!result_ && std::chrono::steady_clock::now() < end)
    if (waitpid(pid_, &status, WNOHANG) == pid_)
      keep_result(status);
    else
      poll(nullptr, 0, 20);
  return result_;
}

void Process::keep_result(int status) {
  result_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, kLastLines, [&] { return ended_; });
}

void Process::read_lines() {
  std::string pending;
  std::array<char, 4096> buffer{};
  ssize_t size = 0;
  while ((size = read(output_, buffer.data(), buffer.size())) > 0) {
    const auto now = std::chrono::steady_clock::now();
    pending.append(buffer.data(), static_cast<std::size_t>(size));
    const std::lock_guard lock(mutex_);
    for (auto end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
      lines_.push_back({pending.substr(0, end), now});
      pending.erase(0, end + 1);
    }
    changed_.notify_all();
  }
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

}  // namespace km
