#include "runtime/supervisor.hpp"

#include <pthread.h>

#include <cerrno>
#include <cmath>
#include <ctime>
#include <stdexcept>

#include "runtime/log.hpp"

namespace km {

SignalWatch::SignalWatch() {
  sigemptyset(&watched_);
  sigaddset(&watched_, SIGINT);
  sigaddset(&watched_, SIGTERM);
  struct sigaction on_hangup {};
  sigaction(SIGHUP, nullptr, &on_hangup);
  if (on_hangup.sa_handler != SIG_IGN) sigaddset(&watched_, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &watched_, &previous_);
  previous_pipe_ = std::signal(SIGPIPE, SIG_IGN);
}

SignalWatch::~SignalWatch() {
  std::signal(SIGPIPE, previous_pipe_);
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

void Supervisor::add(std::unique_ptr<Node> node) {
  for (const auto& other : nodes_)
    if (other->name() == node->name())
      throw std::invalid_argument("Supervisor: two nodes are called " + std::string(node->name()));
  nodes_.push_back(std::move(node));
}

RunResult Supervisor::run(const Finished& finished, double poll_interval_s) {
  RunResult result;
  for (const auto& node : nodes_) node->start();
  while (!result.failure && !result.interrupted && !finished()) {
    result.interrupted = signals_.wait(poll_interval_s).has_value();
    result.failure = first_failure();
  }
  if (result.interrupted) {
    log::info("supervisor") << "interrupted: ending in order; a second signal ends at once";
    signals_.give_up();
  }
  stop_all();
  // A node may also fail on what was left to do.
  if (!result.failure) result.failure = first_failure();
  if (result.failure)
    log::error("supervisor") << result.failure->node << " failed: " << result.failure->message;
  return result;
}

std::optional<RunResult::Failure> Supervisor::first_failure() const {
  for (const auto& node : nodes_)
    if (const std::exception_ptr error = node->error())
      return RunResult::Failure{std::string(node->name()), message_of(error)};
  return std::nullopt;
}

void Supervisor::stop_all() noexcept {
  for (const auto& node : nodes_) node->stop();
}

std::string message_of(const std::exception_ptr& error) try {
  std::rethrow_exception(error);
} catch (const std::exception& e) {
  return e.what();
} catch (...) {
  return "an exception that is not a std::exception";
}

}  // namespace km
