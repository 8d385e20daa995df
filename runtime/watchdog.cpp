#include "runtime/watchdog.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "runtime/log.hpp"

namespace km {
namespace {

std::string for_so_long(bool ending, double s) {
  return (ending ? "has not ended for " : "has not finished one step for ") +
         std::to_string(std::lround(s)) + " s";
}

// Time for which a thread could run, but had no processor, since it started [s]: the second number
// of its schedstat. 0 for a thread that does not exist.
double starved_time_s(pid_t thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/schedstat");
  double runs_ns = 0.0, starves_ns = 0.0;
  return file >> runs_ns >> starves_ns ? 1e-9 * starves_ns : 0.0;
}

}  // namespace

Watchdog::Watchdog(const std::vector<Node*>& nodes, double patience) {
  for (Node* node : nodes) {
    const auto heartbeats = node->heartbeats();
    for (const Heartbeat* heartbeat : heartbeats)
      watched_.push_back({.node = node,
                          .heartbeat = heartbeat,
                          .limit_s = patience * node->step_limit_s(),
                          .beats = heartbeat->beats()});
    if (heartbeats.empty()) watched_.push_back({.node = node, .limit_s = patience * kStopLimit_s});
  }
}

// Between two steps, a node counts as stuck only if it should end.
bool Watchdog::is_stuck(const Watched& watched) {
  if (watched.heartbeat == nullptr) return watched.ending;
  return watched.heartbeat->beats() == watched.beats && !watched.heartbeat->waiting() &&
         (watched.ending || watched.heartbeat->in_step());
}

void Watchdog::look_at(Watched& w, double dt_s) {
  if (!is_stuck(w)) {
    if (w.named)
      log::info("supervisor") << w.node->name() << " continues after " << std::lround(w.stuck_s)
                              << " s";
    w.stuck_s = 0.0;
    w.starved_s.reset();
    w.named = false;
    if (w.heartbeat != nullptr) w.beats = w.heartbeat->beats();
    return;
  }
  w.stuck_s += dt_s;
  const double starved_s = w.heartbeat != nullptr ? starved_time_s(w.heartbeat->thread()) : 0.0;
  if (!w.starved_s) w.starved_s = starved_s;
  // A difference of totals, because Linux counts a wait when it is over.
  const double counted_s = w.stuck_s - (starved_s - *w.starved_s);
  const bool in_step = w.heartbeat != nullptr && w.heartbeat->in_step();
  if (counted_s >= kNotice_s && !w.named && in_step) {
    w.named = true;
    log::warn("supervisor") << w.node->name() << ' ' << for_so_long(false, counted_s)
                            << ": given up after " << w.limit_s << " s";
  }
  if (counted_s >= w.limit_s) w.why = for_so_long(!in_step, counted_s);
}

void Watchdog::tick(double dt_s) {
  std::vector<const Heartbeat*> given_up;
  {
    const std::lock_guard lock(mutex_);
    for (Watched& watched : watched_) {
      if (!watched.why.empty()) continue;
      look_at(watched, dt_s);
      if (!watched.why.empty() && watched.heartbeat != nullptr)
        given_up.push_back(watched.heartbeat);
    }
  }
  for (const Heartbeat* heartbeat : given_up) heartbeat->give_up();
}

void Watchdog::expect_end(const Node& node) {
  const std::lock_guard lock(mutex_);
  for (Watched& watched : watched_)
    if (watched.node == &node) watched.ending = true;
}

void Watchdog::has_ended(const Node& node) {
  const std::lock_guard lock(mutex_);
  std::erase_if(watched_, [&node](const Watched& watched) {
    return watched.node == &node && watched.why.empty();
  });
}

bool Watchdog::has_given_up(const Node& node) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(watched_.begin(), watched_.end(), [&node](const Watched& watched) {
    return watched.node == &node && !watched.why.empty();
  });
}

std::optional<Watchdog::GivenUp> Watchdog::given_up() const {
  const std::lock_guard lock(mutex_);
  for (const Watched& watched : watched_)
    if (!watched.why.empty()) return GivenUp{std::string(watched.node->name()), watched.why};
  return std::nullopt;
}

}  // namespace km
