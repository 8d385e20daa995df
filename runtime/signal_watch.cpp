#include "runtime/signal_watch.hpp"

#include <pthread.h>

#include <cmath>
#include <ctime>

namespace km {

SignalWatch::SignalWatch() {
  sigemptyset(&watched_);
  sigaddset(&watched_, SIGINT);
  sigaddset(&watched_, SIGTERM);
  struct sigaction on_hangup {};
  sigaction(SIGHUP, nullptr, &on_hangup);
  previous_hangup_ = on_hangup.sa_handler;
  if (previous_hangup_ != SIG_IGN) sigaddset(&watched_, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &watched_, &previous_);
  previous_pipe_ = std::signal(SIGPIPE, SIG_IGN);
}

SignalWatch::~SignalWatch() {
  std::signal(SIGPIPE, previous_pipe_);
  std::signal(SIGHUP, previous_hangup_);  // because give_up() ignores SIGHUP
  pthread_sigmask(SIG_SETMASK, &previous_, nullptr);
}

std::optional<int> SignalWatch::wait(double timeout_s) {
  const double whole = std::floor(timeout_s);
  const timespec timeout{static_cast<std::time_t>(whole),
                         static_cast<long>((timeout_s - whole) * 1e9)};
  const int signal = sigtimedwait(&watched_, nullptr, &timeout);
  return signal > 0 ? std::optional(signal) : std::nullopt;
}

void SignalWatch::give_up() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  std::signal(SIGHUP, SIG_IGN);
  pthread_sigmask(SIG_UNBLOCK, &watched_, nullptr);
}

}  // namespace km
