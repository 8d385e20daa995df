#pragma once

#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/node.hpp"
#include "runtime/periodic.hpp"
#include "runtime/signal_watch.hpp"
#include "runtime/watchdog.hpp"

namespace km {

/// Why a robot stopped.
struct RunResult {
  struct Failure {
    std::string node;
    std::string message;
    bool hung = false;  ///< The node made no progress (see Watchdog).
  };
  std::optional<Failure> failure;  ///< Failure of the first node that failed.
  bool interrupted = false;        ///< True if a signal ended the run.
  /// Nodes that could not be stopped: their threads still run. Neither they nor what they use may
  /// be destroyed.
  std::vector<std::string> left_behind = {};

  [[nodiscard]] bool is_left_behind(std::string_view node) const;
};

/// Owns the nodes of a robot and runs them. It starts them with sources last, so that receivers run
/// before messages are published, and watches them. It stops them with sources first, so that
/// inputs in queues are still processed downstream. A node without progress is named and abandoned
/// (see Watchdog), and does not keep other nodes from ending.
class Supervisor {
 public:
  /// Polled while nodes run; true ends the run. Runs on the supervisor's thread.
  using Finished = std::function<bool()>;

  /// `signals` outlives this. `patience` multiplies the time after which nodes are given up.
  explicit Supervisor(SignalWatch& signals, double patience = 1.0)
      : signals_(signals), patience_(patience) {}
  /// Waits for nodes that were left behind, however long that takes.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Adds a node in the order of the data flow, with the bridge to the other robots last. Throws
  /// std::invalid_argument if a node with that name exists.
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

  /// Stops nodes in turn without waiting for them; true once all have stopped or were given up.
  /// `finished` calls it repeatedly.
  bool have_stopped(const std::vector<Node*>& nodes);

  /// Destroys a node. Call after run(), for one that was not left behind.
  void remove(const Node& node);

 private:
  struct Entry {
    std::unique_ptr<Node> node;
    std::future<void> stopped = {};  // its stop() runs on a thread of its own, once
  };
  void start_all();
  void begin_stop(Entry& entry);
  bool wait_for_end(Entry& entry);
  std::optional<RunResult::Failure> first_failure() const;

  SignalWatch& signals_;
  const double patience_;
  std::vector<Entry> nodes_;
  std::optional<Watchdog> watchdog_;    // while nodes run
  std::unique_ptr<Periodic> lookouts_;  // last member: stops before the nodes and watchdog_
};

/// Text of an exception: what(), or a remark if it has none.
[[nodiscard]] std::string message_of(const std::exception_ptr& error);

}  // namespace km
