#include "modules/outlier_rejection/witnessed_pair.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace km {
namespace {

bool near(const KeyframeId& x, const KeyframeId& y) {
  return std::max(x.index, y.index) - std::min(x.index, y.index) <= WitnessedPair::kNeighbourhood;
}

bool share_neighbourhood(const ClosureId& x, const ClosureId& y) {
  return near(x.from, y.from) && near(x.to, y.to);
}

}  // namespace

WitnessedPair::WitnessedPair(RobotId a, RobotId b, const PcmConfig& config)
    : a_(std::min(a, b)),
      b_(std::max(a, b)),
      config_(checked(config)),
      test_(config),
      contest_(config),
      clique_(MaxClique::kMaxSearchNodes) {}

PcmAddResult WitnessedPair::add(const Closure& closure) {
  check_usable(closure, a_, b_);
  const ClosureId id = closure.id();
  if (known_.contains(id)) return PcmAddResult::kRepeated;
  if (known_.size() >= Pcm::kMaxClosures) {
    if (a_ != b_ || !is_witnessed()) return PcmAddResult::kFull;
    thin();
  }
  known_.insert(id);
  added_.insert(id);
  contest_.add(closure);
  if (closure.inliers == 0 && !is_witnessed()) unstated_.insert(id);
  const std::size_t before = witnesses();
  if (!is_witnessed()) test(test_.orient(closure));
  return witnesses() > before ? PcmAddResult::kGrew : PcmAddResult::kAdded;
}

// Keeps the first closures between the same two stretches of keyframes, which determine how the
// stretches lie to each other. Stretches grow until half of the closures are dropped. A robot that
// moves for hours in a known place thus always has room for its newest closures.
void WitnessedPair::thin() {
  constexpr int kKept = 2;  // the noise of closures follows from two at one place
  for (KeyframeIndex stretch = 2 * kNeighbourhood; known_.size() > Pcm::kMaxClosures / 2;
       stretch *= 2) {
    std::map<std::pair<KeyframeIndex, KeyframeIndex>, int> seen;
    std::erase_if(added_, [&](const ClosureId& id) {
      return ++seen[{id.from.index / stretch, id.to.index / stretch}] > kKept;
    });
    known_ = added_;
  }
  contest_.keep(added_);
}

std::vector<ClosureId> WitnessedPair::closures() const {
  std::set<ClosureId> overruled;
  for (const PreparedClosure& closure : tested_)  // empty with witnesses
    if (contradicts_unstated(closure)) overruled.insert(closure.id);
  std::vector<ClosureId> result;
  std::ranges::copy_if(added_, std::back_inserter(result), [&](const ClosureId& id) {
    return !contest_.is_overruled(id) && !overruled.contains(id);
  });
  return result;
}

bool WitnessedPair::contradicts_unstated(const PreparedClosure& closure) const {
  if (unstated_.empty() || unstated_.contains(closure.id)) return false;
  return std::ranges::none_of(tested_, [&](const PreparedClosure& other) {
    return unstated_.contains(other.id) && test_.consistent(closure, other);
  });
}

void WitnessedPair::test(const Closure& closure) {
  PreparedClosure added(closure);
  std::vector<std::size_t> agreeing;
  for (std::size_t k = 0; k < tested_.size(); ++k)
    if (!share_neighbourhood(added.id, tested_[k].id) && test_.consistent(added, tested_[k]))
      agreeing.push_back(k);
  tested_.push_back(std::move(added));
  (void)clique_.add(agreeing);  // witnesses() contains the result
  if (!is_witnessed()) return;
  tested_.clear();
  tested_.shrink_to_fit();
}

bool WitnessedPair::is_witnessed() const {
  return witnesses() >= static_cast<std::size_t>(config_.min_witnesses);
}

}  // namespace km
