#pragma once

#include <csignal>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/node.hpp"

namespace km {

/// Turns SIGINT, SIGTERM and SIGHUP into a question that can be asked, SIGHUP unless it is ignored
/// (nohup); SIGPIPE is ignored: a closed pipe is an error of a write. Make one before any other
/// thread exists: threads inherit the blocked signals. Programs started by this one inherit both,
/// unless what starts them restores previous() and the default of SIGPIPE.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  /// Waits up to `timeout_s` for a signal; its number, or nullopt.
  std::optional<int> wait(double timeout_s);

  /// From now on SIGINT and SIGTERM end the process at once, as if nobody watched. SIGHUP does
  /// nothing more: a terminal that closes may send it several times.
  void give_up();

  /// The signals that were blocked before.
  [[nodiscard]] const sigset_t& previous() const { return previous_; }

 private:
  sigset_t watched_{};
  sigset_t previous_{};
  void (*previous_pipe_)(int) = nullptr;  // what SIGPIPE did before
};

/// Why a robot stopped.
struct RunResult {
  struct Failure {
    std::string node;
    std::string message;
  };
  std::optional<Failure> failure;  ///< Of the first node that failed.
  bool interrupted = false;        ///< By a signal.
};

/// Owns the nodes of a robot and runs them: starts them in order, watches them, and stops them in
/// the same order, sources first, so that what is in flight is still processed downstream.
class Supervisor {
 public:
  /// Asks for the state of the run now and then; true ends it. Runs on the supervisor's thread.
  using Finished = std::function<bool()>;

  /// `signals` outlives this.
  explicit Supervisor(SignalWatch& signals) : signals_(signals) {}
  ~Supervisor() { stop_all(); }
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Adds a node in the order of the data flow; the bridge to the other robots comes last.
  /// Throws std::invalid_argument if a node of that name is there already.
  void add(std::unique_ptr<Node> node);

  /// Builds a node in place and returns it.
  template <typename NodeType, typename... Arguments>
  NodeType& emplace(Arguments&&... arguments) {
    auto node = std::make_unique<NodeType>(std::forward<Arguments>(arguments)...);
    NodeType& reference = *node;
    add(std::move(node));
    return reference;
  }

  /// Runs until `finished`, a node's failure, or a signal, then stops all nodes. The first signal
  /// begins the orderly end; a second one ends the process at once. Call once.
  [[nodiscard]] RunResult run(const Finished& finished, double poll_interval_s = 0.1);

 private:
  std::optional<RunResult::Failure> first_failure() const;
  void stop_all() noexcept;

  SignalWatch& signals_;
  std::vector<std::unique_ptr<Node>> nodes_;
};

/// Text of an exception: what(), or a remark if it has none.
[[nodiscard]] std::string message_of(const std::exception_ptr& error);

}  // namespace km
