#include "modules/session/frame_ties.hpp"

#include <algorithm>
#include <iterator>
#include <set>

namespace km {
namespace {

constexpr std::uint32_t kPlacesOfDatum = 2;  // the fewest that make a tie certain

// The newest offer of `status` to `peer`; nullptr if there is none.
const EdgeSetOffer* newest_offer(const TeamStatus& status, RobotId peer) {
  const auto offer = std::ranges::find(status.offers, peer, &EdgeSetOffer::peer);
  return offer == status.offers.end() ? nullptr : &*offer;
}

// The robots that the ties with counts(tie) connect to `self`.
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

// True if both are members of the session, and it has no closures between them. a < b.
bool lacks_pair(const SessionPlan& plan, RobotId a, RobotId b) {
  const auto is_pair = [&](const SessionPair& pair) { return pair.a == a && pair.b == b; };
  return plan.has_member(a) && plan.has_member(b) && std::ranges::none_of(plan.pairs, is_pair);
}

}  // namespace

std::vector<RobotTie> find_ties(const std::map<RobotId, TeamStatus>& statuses,
                                const SessionPlan* solved) {
  std::vector<RobotTie> ties;
  for (auto one = statuses.begin(); one != statuses.end(); ++one)
    for (auto other = std::next(one); other != statuses.end(); ++other) {
      if (one->second.datum != 0 && one->second.datum == other->second.datum) {
        ties.push_back({one->first, other->first, kPlacesOfDatum, false});
        continue;
      }
      const EdgeSetOffer* ours = newest_offer(one->second, other->first);
      const EdgeSetOffer* theirs = newest_offer(other->second, one->first);
      if (ours == nullptr || theirs == nullptr) continue;
      const std::uint32_t places = std::min(ours->places, theirs->places);
      if (places > 0 && (solved == nullptr || !lacks_pair(*solved, one->first, other->first)))
        ties.push_back(
            {one->first, other->first, places, ours->contradicted || theirs->contradicted});
    }
  return ties;
}

FrameTies frame_ties(RobotId self, std::span<const RobotId> members,
                     std::span<const RobotTie> ties) {
  std::vector<RobotTie> usable;
  std::ranges::copy_if(ties, std::back_inserter(usable),
                       [](const RobotTie& tie) { return tie.places == 1 || !tie.contradicted; });
  const auto is_bridge = [&](const RobotTie& bridge) {
    const auto others = [&](const RobotTie& tie) { return tie != bridge; };
    return !reached(bridge.a, usable, others).contains(bridge.b);
  };
  std::set<RobotTie> uncertain;
  for (const RobotTie& tie : usable)
    if (tie.places == 1 && is_bridge(tie)) uncertain.insert(tie);
  const std::set<RobotId> tied = reached(self, usable, [&](const RobotTie& tie) {
    return !tie.contradicted || !uncertain.contains(tie);
  });
  const std::set<RobotId> certain =
      reached(self, usable, [&](const RobotTie& tie) { return !uncertain.contains(tie); });
  FrameTies result;
  for (const RobotId robot : members) {
    if (!tied.contains(robot))
      result.not_joined.push_back(robot);
    else if (!certain.contains(robot))
      result.tentative.push_back(robot);
  }
  return result;
}

RobotId lowest_tied(RobotId self, const SessionPlan& plan, const FrameTies& ties) {
  RobotId lowest = self;
  for (const SessionMember& member : plan.members)
    if (!std::ranges::binary_search(ties.not_joined, member.peer.robot))
      lowest = std::min(lowest, member.peer.robot);
  return lowest;
}

}  // namespace km
