#include "apps/team/robot_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "runtime/clock.hpp"

namespace km {
namespace {

constexpr std::size_t kLastLogLines = 12;
constexpr double kGrace_s = 20.0;
constexpr int kPoll_ms = 50;

std::runtime_error system_error(const std::string& what) {
  return std::runtime_error(what + ": " + std::generic_category().message(errno));
}

// Pipe whose read end does not block; both ends are closed on exec.
std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw system_error("pipe");
  fcntl(ends[0], F_SETFL, O_NONBLOCK);
  return ends;
}

// Prints the meaning of `errno` to standard error and exits.
[[noreturn]] void give_up() {
  const char* const reason = strerrordesc_np(errno);
  [[maybe_unused]] ssize_t written = write(STDERR_FILENO, "cannot be started: ", 19);
  written = write(STDERR_FILENO, reason, std::strlen(reason));
  _exit(127);
}

// Runs in the child between fork and exec: async-signal-safe calls only.
[[noreturn]] void become(char* const* arguments, int out, int err, const sigset_t& blocked,
                         pid_t parent, const std::function<bool()>& prepare) {
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  // Before prctl(): a change of privileges clears its setting.
  if (prepare && !prepare()) give_up();
  // SIGHUP, because a second SIGTERM would end the robot at once.
  prctl(PR_SET_PDEATHSIG, SIGHUP);
  if (getppid() != parent) _exit(127);  // the parent died before the line above
  setpgid(0, 0);
  signal(SIGHUP, SIG_DFL);  // nohup would otherwise make robots ignore SIGHUP
  signal(SIGPIPE, SIG_DFL);
  sigprocmask(SIG_SETMASK, &blocked, nullptr);
  const int nothing = open("/dev/null", O_RDONLY);
  if (nothing >= 0) dup2(nothing, STDIN_FILENO);
  execv(arguments[0], arguments);
  give_up();
}

}  // namespace

std::string to_string(const ProcessExit& exit) {
  if (exit.signal != 0) {
    const char* const name = sigdescr_np(exit.signal);
    return "ended by signal " + std::to_string(exit.signal) +
           (name != nullptr ? " (" + std::string(name) + ')' : std::string());
  }
  return "exit code " + std::to_string(exit.code);
}

RobotProcess::RobotProcess(const std::vector<std::string>& command, const sigset_t& blocked,
                           const std::filesystem::path& log, const std::function<bool()>& prepare)
    : log_(log) {
  if (!log_) throw std::runtime_error(log.string() + ": cannot be written");
  std::vector<char*> arguments;
  std::vector<std::string> texts = command;  // execv needs mutable texts
  arguments.reserve(texts.size() + 1);
  for (std::string& text : texts) arguments.push_back(text.data());
  arguments.push_back(nullptr);

  const auto out = make_pipe();
  const auto err = make_pipe();
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) become(arguments.data(), out[1], err[1], blocked, parent, prepare);
  close(out[1]);
  close(err[1]);
  out_.fd = Descriptor(out[0]);
  err_.fd = Descriptor(err[0]);
  if (pid_ < 0) throw system_error("fork");
}

RobotProcess::~RobotProcess() {
  if (!exit_ && pid_ > 0) {
    ask_to_end();
    const double end_s = steady_now_s() + kGrace_s;
    // Full pipes might block the process, so its output is read meanwhile.
    while (!exit_ && steady_now_s() < end_s) {
      const auto [out, err] = descriptors();
      std::array<pollfd, 2> polled{{{out, POLLIN, 0}, {err, POLLIN, 0}}};
      poll(polled.data(), polled.size(), kPoll_ms);
      read();
    }
    send(SIGKILL);
    if (!exit_) waitpid(pid_, nullptr, 0);
  }
}

std::vector<std::string> RobotProcess::drain(Pipe& pipe) {
  std::vector<std::string> lines;
  std::array<char, 4096> buffer{};
  while (pipe.fd.get() >= 0) {
    const ssize_t n = ::read(pipe.fd.get(), buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
    if (n <= 0) {
      pipe.fd = Descriptor();
      if (!pipe.partial.empty()) lines.push_back(std::exchange(pipe.partial, {}));
      break;
    }
    pipe.partial.append(buffer.data(), static_cast<std::size_t>(n));
    for (auto end = pipe.partial.find('\n'); end != std::string::npos;
         end = pipe.partial.find('\n')) {
      lines.push_back(pipe.partial.substr(0, end));
      pipe.partial.erase(0, end + 1);
    }
  }
  for (const std::string& line : lines) log_ << line << std::endl;
  return lines;
}

std::vector<std::string> RobotProcess::read() {
  int status = 0;
  // Called before the pipes are read: if the process has ended, they hold all of its output.
  const bool ended = !exit_ && waitpid(pid_, &status, WNOHANG) == pid_;
  std::vector<std::string> lines = drain(out_);
  for (std::string& line : drain(err_)) {
    last_log_lines_.push_back(std::move(line));
    if (last_log_lines_.size() > kLastLogLines) last_log_lines_.pop_front();
  }
  if (ended)
    exit_ = WIFSIGNALED(status) ? ProcessExit{0, WTERMSIG(status)}
                                : ProcessExit{WEXITSTATUS(status), 0};
  return lines;
}

void RobotProcess::send(int signal) {
  asked_ = true;
  if (!exit_) kill(pid_, signal);
}

void RobotProcess::ask_to_end() {
  if (!asked_) send(SIGTERM);
}

}  // namespace km
