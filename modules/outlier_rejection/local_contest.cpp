#include "modules/outlier_rejection/local_contest.hpp"

#include <algorithm>

namespace km {
namespace {

PcmConfig tolerant(PcmConfig config) {
  constexpr double kLargest = 1000.0;  // bound of both scales
  for (double* scale : {&config.odometry_noise_scale, &config.closure_noise_scale})
    *scale = std::min(kLargest, LocalContest::kNoise * *scale);
  return config;
}

bool is_near(const KeyframeId& x, const KeyframeId& y) {
  return std::max(x.index, y.index) - std::min(x.index, y.index) <= LocalContest::kNear;
}

}  // namespace

LocalContest::LocalContest(const PcmConfig& config) : test_(tolerant(config)) {}

void LocalContest::add(const Closure& closure) {
  const auto inliers = static_cast<double>(closure.inliers);
  const auto [place, is_new] = entries_.try_emplace(
      closure.id(), Entry{PreparedClosure(test_.orient(closure)), inliers, inliers});
  if (is_new) weigh(place->second);
}

void LocalContest::weigh(Entry& added) {
  const ClosureId& id = added.closure.id;
  const KeyframeIndex first = id.from.index - std::min(id.from.index, kNear);
  for (auto other = entries_.lower_bound({{id.from.robot, first}, {0, 0}});
       other != entries_.end() && is_near(other->first.from, id.from); ++other) {
    Entry& entry = other->second;
    if (&entry == &added || !is_near(other->first.to, id.to)) continue;
    if (test_.consistent(added.closure, entry.closure)) {
      added.support += entry.inliers;
      entry.support += added.inliers;
      most_support_ = std::max(most_support_, entry.support);
    } else {
      added.against.push_back(other->first);
      entry.against.push_back(id);
    }
  }
  most_support_ = std::max(most_support_, added.support);
}

void LocalContest::keep(const std::set<ClosureId>& kept) {
  const auto is_dropped = [&](const ClosureId& id) { return !kept.contains(id); };
  std::erase_if(entries_, [&](const auto& entry) { return is_dropped(entry.first); });
  for (auto& [id, entry] : entries_) std::erase_if(entry.against, is_dropped);
}

bool LocalContest::is_overruled(const ClosureId& closure) const {
  const auto found = entries_.find(closure);
  return found != entries_.end() &&
         std::ranges::any_of(found->second.against, [&](const ClosureId& other) {
           const double support = entries_.at(other).support;
           return support > 0.0 && support >= kRatio * found->second.support;
         });
}

}  // namespace km
