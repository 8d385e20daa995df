#include "modules/pose_graph/frame_ties.hpp"

#include <algorithm>
#include <optional>
#include <set>

namespace km {
namespace {

// The newest offer of `status` to `peer`; nullptr if there is none.
const EdgeSetOffer* newest_offer(const TeamStatus& status, RobotId peer) {
  const auto offer = std::ranges::find(status.offers, peer, &EdgeSetOffer::peer);
  return offer == status.offers.end() ? nullptr : &*offer;
}

// The robots that `ties` connect to `self`.
template <typename Counts>
std::set<RobotId> reached(RobotId self, std::span<const RobotTie> ties, const Counts& counts) {
  std::set<RobotId> robots{self};
  for (bool grown = true; grown;) {
    grown = false;
    for (const RobotTie& tie : ties)
      if (counts(tie) && robots.contains(tie.a) != robots.contains(tie.b)) {
        robots.insert({tie.a, tie.b});
        grown = true;
      }
  }
  return robots;
}

}  // namespace

std::vector<RobotTie> find_ties(const std::map<RobotId, TeamStatus>& statuses) {
  std::vector<RobotTie> ties;
  for (const auto& [a, status] : statuses) {
    std::optional<RobotId> last;
    for (const EdgeSetOffer& offer : status.offers) {
      const auto other = statuses.find(offer.peer);
      if (offer.peer <= a || offer.peer == last || other == statuses.end()) continue;
      last = offer.peer;
      const EdgeSetOffer* theirs = newest_offer(other->second, a);
      const std::uint32_t places = theirs ? std::min(offer.places, theirs->places) : 0;
      if (places == 0) continue;
      ties.push_back({a, offer.peer, places, offer.contested || theirs->contested});
    }
  }
  return ties;
}

FrameTies frame_ties(RobotId self, std::span<const RobotId> members,
                     std::span<const RobotTie> ties) {
  const auto is_bridge = [&](const RobotTie& bridge) {
    const auto others = [&](const RobotTie& tie) { return tie != bridge; };
    return !reached(bridge.a, ties, others).contains(bridge.b);
  };
  std::set<RobotTie> uncertain;
  for (const RobotTie& tie : ties)
    if (tie.places == 1 && is_bridge(tie)) uncertain.insert(tie);
  const std::set<RobotId> tied = reached(
      self, ties, [&](const RobotTie& tie) { return !tie.contested || !uncertain.contains(tie); });
  const std::set<RobotId> certain =
      reached(self, ties, [&](const RobotTie& tie) { return !uncertain.contains(tie); });
  FrameTies result;
  for (const RobotId robot : members) {
    if (!tied.contains(robot))
      result.untied.push_back(robot);
    else if (!certain.contains(robot))
      result.tentative.push_back(robot);
  }
  return result;
}

}  // namespace km
