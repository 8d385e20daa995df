#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <variant>

#include "modules/core/waiting_rooms.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Of several processes that tell as one robot the first counts, as it does for the robots. What
/// another one tells waits, within bounds, until the first has left or has not been heard for
/// kSilent_s: then that one counts, from its beginning. Pure: time comes in [s], any origin, and
/// does not go backwards. Not thread-safe.
class ViewIncumbents {
 public:
  /// Robots tell their state once a second.
  static constexpr double kSilent_s = 5.0;
  /// So long what others tell is kept, kMostWaiting updates of each.
  static constexpr double kKept_s = 30.0;
  static constexpr std::size_t kMostWaiting = 1000;

  /// Hands `update` to `take` if it counts now, else keeps it for serve().
  template <typename Take>
  void add(ViewUpdate update, double now_s, const Take& take) {
    const auto [incumbent, is_new] =
        incumbents_.try_emplace(update.robot, Incumbent{update.boot, now_s});
    if (incumbent->second.boot == update.boot) return pass(std::move(update), now_s, take);
    const Process from{update.robot, update.boot};
    dropped_ += !waiting_.push(from, std::move(update), 1, now_s);
  }

  /// Hands on what has waited long enough.
  template <typename Take>
  void serve(double now_s, const Take& take) {
    const auto one = [&](const Process& from, ViewUpdate& update, double waited_s) {
      Incumbent& incumbent = incumbents_.at(from.first);
      if (now_s - incumbent.heard_s.value_or(now_s - kSilent_s) >= kSilent_s)
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

  /// Updates that never counted.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  using Process = std::pair<RobotId, std::uint64_t>;  // and its boot
  struct Incumbent {
    std::uint64_t boot = 0;
    std::optional<double> heard_s;  // last; none once it has left
  };

  template <typename Take>
  void pass(ViewUpdate update, double now_s, const Take& take) {
    const auto* const state = std::get_if<ViewState>(&update.content);
    const bool leaves = state != nullptr && state->phase == "leaving";
    incumbents_.at(update.robot).heard_s = leaves ? std::nullopt : std::optional(now_s);
    take(std::move(update));
  }

  std::map<RobotId, Incumbent> incumbents_;
  WaitingRooms<Process, ViewUpdate> waiting_{
      {.bytes = 4 * kMostWaiting, .bytes_of_one = kMostWaiting}};  // each counts as one
  std::uint64_t dropped_ = 0;
};

}  // namespace km
