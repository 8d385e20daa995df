#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "runtime/node.hpp"

namespace km {

/// Finds nodes without progress. A node that has not finished a step for kNotice_s is named in the
/// log. One that has not for its step_limit_s() is abandoned. The time for which a busy machine
/// leaves its thread without a processor does not count. Thread-safe.
class Watchdog {
 public:
  static constexpr double kNotice_s = 4.0;
  /// Time for a node without heartbeats to end: it may have much to send over a slow link.
  static constexpr double kStopLimit_s = 120.0;

  /// `nodes` outlive this. `patience` multiplies all limits.
  Watchdog(const std::vector<Node*>& nodes, double patience);

  /// Checks all nodes; `dt_s` have passed since the last check. It should exclude time in which the
  /// process did not run.
  void tick(double dt_s);

  /// From now on, `node` also counts as stuck while it makes no steps, because it should end.
  void expect_end(const Node& node);

  /// `node` has ended and is not checked any more.
  void has_ended(const Node& node);

  [[nodiscard]] bool has_given_up(const Node& node) const;

  /// A node that was given up because a step or its end took too long, and the reason.
  struct GivenUp {
    std::string node;
    std::string why;  ///< "has not finished one step for 30 s"
  };
  /// The first such node in the order of the data flow; nullopt if there is none.
  [[nodiscard]] std::optional<GivenUp> given_up() const;

 private:
  /// One heartbeat of a node, or the node itself if it has none.
  struct Watched {
    Node* node = nullptr;
    const Heartbeat* heartbeat = nullptr;
    double limit_s = 0.0;
    std::uint64_t beats = 0;
    double stuck_s = 0.0;
    std::optional<double> starved_s = {};  // by starved_time_s(), as it became stuck
    bool named = false;
    bool ending = false;
    std::string why = {};  // reason if it was given up, otherwise empty
  };
  [[nodiscard]] static bool is_stuck(const Watched& watched);
  static void look_at(Watched& watched, double dt_s);

  mutable std::mutex mutex_;  // guards watched_
  std::vector<Watched> watched_;
};

}  // namespace km
