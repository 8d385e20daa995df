#include "apps/robot/unmet_peers.hpp"

#include <algorithm>

#include "runtime/log.hpp"

namespace km {

void UnmetPeers::update(double now_s, std::span<const Peer> met,
                        std::map<std::string, std::string> unmet) {
  // A participant that was named stays while a new one of its program is discovered.
  constexpr double kUnmet_s = 5.0, kKept_s = 10.0;
  constexpr std::size_t kMostKept = 100;  // bound on those that were logged
  is_alone_ = met.empty();
  if (met.empty() && unmet.empty())
    for (const std::string& host : hosts_)
      unmet["dds.peers " + host] =
          "no robot there is received: none runs, or a firewall or NAT is between";
  for (const auto& [name, why] : unmet) {
    Unmet& known = unmet_.try_emplace(name, Unmet{.since_s = now_s}).first->second;
    known.why = why;
    known.last_s = now_s;
    if (now_s - known.since_s >= kUnmet_s && !std::exchange(known.is_logged, true))
      log::warn("peers") << name << " is not met: " << why;
  }
  std::erase_if(unmet_, [now_s, is_room = unmet_.size() <= kMostKept](const auto& entry) {
    const auto& [name, one] = entry;
    const bool is_kept = name.ends_with(')');
    return now_s - one.last_s > (is_kept ? kKept_s : 0.0) && !(is_kept && one.is_logged && is_room);
  });
  for (const Peer& peer : met) unmet_.erase(to_string(peer.identity));
}

bool UnmetPeers::awaits(double now_s) const {
  constexpr double kAlone_s = 6.0;     // three announcements, and the time to start another robot
  constexpr double kNoticed_s = 30.0;  // twice the time after which a participant is renewed
  return (is_alone_ && now_s < kAlone_s) || std::ranges::any_of(unmet_, [now_s](const auto& entry) {
           return now_s - entry.second.since_s < kNoticed_s;
         });
}

std::map<std::string, std::string> UnmetPeers::reasons() const {
  std::map<std::string, std::string> reasons;
  for (const auto& [name, unmet] : unmet_) reasons[name] = unmet.why;
  return reasons;
}

}  // namespace km
