#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <variant>

#include "modules/core/data/pending_messages.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Chooses among several processes that send updates with one robot id: the first one counts, as in
/// the team. Updates of other processes wait, within bounds, until the first one has left or has
/// been silent for kSilent_s. Then the next process counts, with all its waiting updates.
/// Deterministic: time comes in [s], with any origin, and does not decrease. Not thread-safe.
class ViewIncumbents {
 public:
  /// Time without updates after which a process no longer counts; robots send their state once a
  /// second.
  static constexpr double kSilent_s = 5.0;
  /// Time for which updates of other processes wait, at most kMostWaiting updates of each process.
  static constexpr double kKept_s = 30.0;
  static constexpr std::size_t kMostWaiting = 1000;

  /// Passes `update` to `take` if its process counts now, otherwise keeps it for serve().
  template <typename Take>
  void add(ViewUpdate update, double now_s, const Take& take) {
    const auto [incumbent, is_new] =
        incumbents_.try_emplace(update.robot, Incumbent{update.boot, now_s});
    if (incumbent->second.boot == update.boot) return pass(std::move(update), now_s, take);
    const Process from{update.robot, update.boot};
    dropped_ += !waiting_.push(from, std::move(update), 1, now_s);
  }

  /// Passes the waiting updates of processes that count now to `take`.
  template <typename Take>
  void serve(double now_s, const Take& take) {
    const auto one = [&](const Process& from, ViewUpdate& update, double waited_s) {
      Incumbent& incumbent = incumbents_.at(from.first);
      if (now_s - incumbent.last_received_s.value_or(now_s - kSilent_s) >= kSilent_s)
        incumbent.boot = from.second;
      if (incumbent.boot == from.second) {
        pass(std::move(update), now_s, take);
        return true;
      }
      dropped_ += waited_s > kKept_s;
      return waited_s > kKept_s;
    };
    while (waiting_.serve(now_s, one) > 0) {
    }
  }

  /// Number of updates that never counted.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  using Process = std::pair<RobotId, std::uint64_t>;  // Robot id and boot id.
  struct Incumbent {
    std::uint64_t boot = 0;
    std::optional<double>
        last_received_s;  // Time of the last update; none after the process has left.
  };

  template <typename Take>
  void pass(ViewUpdate update, double now_s, const Take& take) {
    const auto* const state = std::get_if<RobotSample>(&update.content);
    const bool leaves = state != nullptr && state->phase == "leaving";
    incumbents_.at(update.robot).last_received_s = leaves ? std::nullopt : std::optional(now_s);
    take(std::move(update));
  }

  std::map<RobotId, Incumbent> incumbents_;
  PendingMessages<Process, ViewUpdate> waiting_{
      {.bytes = 4 * kMostWaiting, .bytes_of_one = kMostWaiting}};  // Each update has size 1, so
                                                                   // sizes are counts.
  std::uint64_t dropped_ = 0;
};

}  // namespace km
