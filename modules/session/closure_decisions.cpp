#include "modules/session/closure_decisions.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

namespace km {

bool ClosureDecisions::is_rejected(const ClosureId& id) const {
  const auto decided = decided_.find(id);
  return decided != decided_.end() && !decided->second;
}

void ClosureDecisions::begin_result(std::span<const RobotId> members) {
  counted_.clear();
  std::erase_if(decided_, [&](const auto& entry) {
    return std::ranges::binary_search(members, entry.first.from.robot) &&
           std::ranges::binary_search(members, entry.first.to.robot);
  });
}

void ClosureDecisions::decide(std::span<const WeighedClosure> verdicts) {
  if (verdicts.empty()) return;
  for (const auto& [id, kept] : verdicts) decided_[id] = kept;
  verdicts_due_ = true;
  counted_.clear();
}

void ClosureDecisions::discard(RobotId robot) {
  std::erase_if(decided_, [&](const auto& entry) { return touches(entry.first, robot); });
  counted_.clear();
}

std::optional<ClosureVerdicts> ClosureDecisions::take_verdicts() {
  if (!std::exchange(verdicts_due_, false)) return std::nullopt;
  ClosureVerdicts result;
  for (const auto& [id, kept] : decided_) result.closures.push_back({id, kept});
  return result;
}

void ClosureDecisions::count_places(EdgeSetOffer& offer, std::span<const PoseEdge> closures,
                                    std::span<const AlignedOdometry> all) {
  const auto [entry, is_new] = counted_.try_emplace({offer.peer, offer.id}, offer);
  if (is_new) {
    // Once a session has weighed closures of the pair, offered now or not, its solution places the
    // robots by the kept ones: undecided ones wait for the next session.
    const auto is_of_pair = [&](const auto& of_one) { return touches(of_one.first, offer.peer); };
    const bool weighed = std::ranges::any_of(decided_, is_of_pair);
    std::vector<PoseEdge> accepted, rejected;
    std::vector<ClosureId> kept;
    for (const PoseEdge& closure : closures) {
      if (is_rejected(closure.id()))
        rejected.push_back(closure);
      else if (!weighed || decided_.contains(closure.id()))
        accepted.push_back(closure);
    }
    std::ranges::transform(accepted, std::back_inserter(kept), &PoseEdge::id);
    const std::vector<std::size_t> rivals = find_rows(rejected).sizes;
    // Robots that share one way have one row. It counts by its places while nothing contradicts it.
    const ClosureGroups groups = rejected.empty() ? find_places(accepted) : find_rows(accepted);
    const std::size_t places = groups.sizes.size();
    const std::size_t largest_rival = rivals.empty() ? 0 : std::ranges::max(rivals);
    const bool single = places == 1 && largest_rival > 0 && largest_rival >= accepted.size();
    EdgeSetOffer& counted = entry->second;
    counted.places = static_cast<std::uint32_t>(places);
    counted.contradicted = single || (places > 1 && count_rival_rows(all, kept) >= places);
    // Two placements that differ by less than two rows.
    if (places > 1 && static_cast<double>(largest_rival) >= kVotesOfPlace) --counted.places;
  }
  offer = entry->second;
}

}  // namespace km
