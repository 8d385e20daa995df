#include "runtime/supervisor.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"
#include "runtime/thread.hpp"

namespace km {

bool RunResult::is_left_behind(std::string_view node) const {
  return std::find(left_behind.begin(), left_behind.end(), node) != left_behind.end();
}

Supervisor::~Supervisor() {
  for (Entry& entry : nodes_) {
    if (entry.stopped.valid())
      entry.stopped.wait();
    else
      entry.node->stop();
  }
}

void Supervisor::add(std::unique_ptr<Node> node) {
  for (const Entry& other : nodes_)
    if (other.node->name() == node->name())
      throw std::invalid_argument("Supervisor: two nodes are called " + std::string(node->name()));
  nodes_.push_back({std::move(node)});
}

RunResult Supervisor::run(const Finished& finished, double poll_interval_s) {
  RunResult result;
  start_all();
  while (!result.failure && !result.interrupted && !finished()) {
    result.interrupted = signals_.wait(poll_interval_s).has_value();
    result.failure = first_failure();
  }
  if (result.interrupted) {
    log::info("supervisor") << "interrupted: ending in order; a second signal ends at once";
    signals_.give_up();
  }
  if (result.failure)
    log::error("supervisor") << result.failure->node << " failed: " << result.failure->message;
  const bool failed_before = result.failure.has_value();
  for (Entry& entry : nodes_)
    if (!wait_for_end(entry)) result.left_behind.emplace_back(entry.node->name());
  // A node may also fail on its remaining inputs.
  if (!failed_before) result.failure = first_failure();
  if (result.failure && !failed_before)
    log::error("supervisor") << result.failure->node << " failed: " << result.failure->message;
  return result;
}

void Supervisor::start_all() {
  std::vector<Node*> nodes;
  for (const Entry& entry : nodes_) nodes.push_back(entry.node.get());
  watchdog_.emplace(nodes, patience_);
  lookouts_ = std::make_unique<Periodic>(
      std::chrono::milliseconds(100),
      [this, last_s = steady_now_s()]() mutable {
        // A longer interval means that the process did not run, or too little to blame a node.
        constexpr double kLongest_s = 0.5;
        const double now_s = steady_now_s();
        watchdog_->tick(std::min(now_s - std::exchange(last_s, now_s), kLongest_s));
      },
      "watchdog");
  lookouts_->start();
  for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) (*node)->start();
}

void Supervisor::begin_stop(Entry& entry) {
  if (entry.stopped.valid()) return;
  watchdog_->expect_end(*entry.node);
  std::packaged_task<void()> stop([this, node = entry.node.get()] {
    node->stop();
    watchdog_->has_ended(*node);
  });
  entry.stopped = stop.get_future();
  start_without_signals(std::move(stop)).detach();  // detached, because stop() never returns if the
                                                    // node hangs
}

// False if the node was given up and still does not end.
bool Supervisor::wait_for_end(Entry& entry) {
  constexpr std::chrono::milliseconds kPoll{20};
  constexpr std::chrono::seconds kGrace{1};
  begin_stop(entry);
  while (entry.stopped.wait_for(kPoll) != std::future_status::ready)
    if (watchdog_->has_given_up(*entry.node))
      return entry.stopped.wait_for(kGrace) == std::future_status::ready;
  return true;
}

bool Supervisor::have_stopped(const std::vector<Node*>& nodes) {
  for (const Node* node : nodes) {
    const auto entry = std::find_if(nodes_.begin(), nodes_.end(),
                                    [node](const Entry& e) { return e.node.get() == node; });
    if (entry == nodes_.end()) continue;
    begin_stop(*entry);
    const bool ended =
        entry->stopped.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    if (!ended && !watchdog_->has_given_up(*node)) return false;
  }
  return true;
}

void Supervisor::remove(const Node& node) {
  lookouts_.reset();  // before the node is destroyed, because it checks all nodes
  std::erase_if(nodes_, [&node](const Entry& entry) { return entry.node.get() == &node; });
}

std::optional<RunResult::Failure> Supervisor::first_failure() const {
  for (const Entry& entry : nodes_)
    if (const std::exception_ptr error = entry.node->error())
      return RunResult::Failure{std::string(entry.node->name()), message_of(error)};
  if (const auto hung = watchdog_->given_up())
    return RunResult::Failure{hung->node, hung->why, true};
  return std::nullopt;
}

std::string message_of(const std::exception_ptr& error) try {
  std::rethrow_exception(error);
} catch (const std::exception& e) {
  return e.what();
} catch (...) {
  return "an exception that is not a std::exception";
}

}  // namespace km
